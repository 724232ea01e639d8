"""The DAQ bridge's parameters."""

from . import ready
from .parameters import Parameter

PACES = ("realtime", "lockstep")
TABLE = (
    *ready.TABLE,
    Parameter("backend", "virtual", "the object: virtual rig, replay of recorded data, or another backend", fixed=True),
    Parameter("backend_options", "{}", "the backend's options, a YAML mapping", fixed=True),
    Parameter("sample_time_s", 0.02, "time between samples", "s", 1e-4, 60.0, fixed=True),
    Parameter(
        "pace", "realtime", "by the clock, or as fast as the answers come", choices=("realtime", "lockstep"), fixed=True
    ),
    Parameter("duration_s", 0.0, "length of the run; 0: until stopped", "s", 0.0, 1e7, fixed=True),
    Parameter("expect", ["load", "position"], "channels whose commands are waited for", fixed=True),
    Parameter("followers", [], "nodes that lockstep does not run away from: twin, shadow", fixed=True),
    Parameter("max_lead", 50, "how far lockstep may run ahead of the followers", "samples", 1, 100, fixed=True),
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
    Parameter("exit_at_end", False, "end the process after the run", fixed=True),
)
