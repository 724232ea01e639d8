"""The DAQ bridge's parameters."""

from collections.abc import Mapping, Sequence
from typing import Any

from ..core.channels import Channel
from . import ready
from .parameters import Parameter, ParameterError
from .registry import NOBODY

EXPECT = {"load": Channel.PRESSURE, "position": Channel.POSITION}
FOLLOWERS = ("twin", "shadow")
PACES = ("realtime", "lockstep")
TABLE = (
    *ready.TABLE,
    Parameter("wait_for_nodes", 0, "nodes to wait for until they are ready", "nodes", 0, 100, fixed=True),
    Parameter("backend", "virtual", "the object: virtual rig, replay of recorded data, or another backend", fixed=True),
    Parameter("backend_options", "{}", "the backend's options, a YAML mapping", fixed=True),
    Parameter("sample_time_s", 0.02, "time between samples", "s", 1e-4, 60.0, fixed=True),
    Parameter(
        "pace", "realtime", "by the clock, or as fast as the answers come", choices=("realtime", "lockstep"), fixed=True
    ),
    Parameter("duration_s", 0.0, "length of the run; 0: until stopped", "s", 0.0, 1e7, fixed=True),
    Parameter("expect", ["load", "position"], "channels whose commands are waited for, or nobody", fixed=True),
    Parameter("followers", [], "nodes that lockstep does not run away from: twin, shadow", fixed=True),
    Parameter("max_lead", 50, "how far lockstep may run ahead of the followers", "samples", 1, 100, fixed=True),
    Parameter(
        "follower_timeout_s",
        10.0,
        "lockstep: how long a follower that fell silent is waited for",
        "s",
        1e-3,
        600.0,
        fixed=True,
    ),
    Parameter("command_timeout_s", 1.0, "lockstep: how long a command is waited for", "s", 1e-3, 600.0, fixed=True),
    Parameter(
        "patience",
        5,
        "lockstep: samples in a row after which a silent controller is not waited for",
        "samples",
        1,
        10**6,
        fixed=True,
    ),
    Parameter(
        "command_delay",
        0,
        "delay of a command; 1: cards that latch",
        "samples",
        0,
        1,
        fixed=True,
    ),
    Parameter("held", False, "lockstep: take no samples until this is false again"),
    Parameter("held_from", -1, "lockstep: take no sample from this number on; -1: take all", "samples", -1, 10**9),
    Parameter("exit_at_end", False, "end the process after the run", fixed=True),
)


def checked(values: Mapping[str, Any]) -> dict[str, Any]:
    """All values, which go together. Raises ParameterError."""
    if (values["held"] or values["held_from"] >= 0) and values["pace"] != "lockstep":
        raise ParameterError(
            "held: only lockstep can be held, in real time the object goes on; stop the station instead"
        )
    return dict(values)


def holding(values: Mapping[str, Any]) -> tuple[bool, int | None]:
    """Whether samples are held, and the number from which on they are."""
    return values["held"], values["held_from"] if values["held_from"] >= 0 else None


def awaited(expect: Sequence[str], followers: Sequence[str]) -> frozenset[Channel]:
    """The channels whose commands are waited for. Raises ParameterError for a name that neither list takes."""
    unknown = [name for name in expect if name not in (*EXPECT, NOBODY)]
    unknown += [f"follower {name}" for name in followers if name not in FOLLOWERS]
    if unknown:
        raise ParameterError(f"{unknown[0]} is unknown: expect takes load, position; followers take twin, shadow")
    return frozenset(EXPECT[name] for name in expect if name != NOBODY)
