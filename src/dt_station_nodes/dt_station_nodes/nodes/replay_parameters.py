"""What a replay can be told."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from . import ready
from .parameters import Parameter, ParameterError

FOLLOWERS = {
    "twin": ("twin/state", "dt_station_msgs/msg/PlantState"),
    "shadow": ("shadow/residual", "dt_station_msgs/msg/Residual"),
}
TABLE = (
    *ready.TABLE,
    Parameter("bag", "", "the bag to play", fixed=True),
    Parameter("topics", [], "topics to play; none: all, or in lockstep the inputs of twin and shadow", fixed=True),
    Parameter("remap", [], "topics to play under another name, each OLD=NEW", fixed=True),
    Parameter("rate", 1.0, "speed; 0: as fast as possible", "1", 0.0, 1e6),
    Parameter("paused", False, "stand still; ~/step then plays one sample"),
    Parameter("from_s", 0.0, "start of the stretch played", "s", 0.0, 1e9, fixed=True),
    Parameter("to_s", 0.0, "end of the stretch played; 0: the bag's end", "s", 0.0, 1e9, fixed=True),
    Parameter("loop", False, "begin anew at the end", fixed=True),
    Parameter("clock", True, "publish /clock", fixed=True),
    Parameter("followers", [], "lockstep: those whose answers are waited for: twin, shadow", fixed=True),
    Parameter("follow_timeout_s", 2.0, "lockstep: how long an answer is waited for", "s", 1e-3, 600.0, fixed=True),
    Parameter("least_readers", 1, "readers of the samples to wait for", "readers", 0, 100, fixed=True),
    Parameter("exit_at_end", True, "end the process after the last message", fixed=True),
)


def checked(values: Mapping[str, Any]) -> Mapping[str, Any]:
    """The values, judged together. Raises ParameterError."""
    if not values["bag"] or not Path(values["bag"]).exists():
        raise ParameterError(f"there is no bag {values['bag']!r}; name one, such as -p bag:=runs/demo/pid")
    if values["to_s"] and values["to_s"] <= values["from_s"]:
        raise ParameterError(f"to_s {values['to_s']:g} is not after from_s {values['from_s']:g}")
    unknown = sorted(set(values["followers"]) - set(FOLLOWERS))
    if unknown:
        raise ParameterError(f"followers takes twin and shadow, got {unknown[0]!r}")
    return values
