"""The executables, and who reads and writes which topic: what readiness and supervision are computed from."""

import importlib
import importlib.util
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ..core.errors import StationError

NODES = (
    "daq_bridge",
    "load_generator",
    "pressure_controller",
    "position_controller",
    "twin_simulator",
    "shadow_compare",
    "recorder",
    "replayer",
    "panel",
)

# what the bridge expects where there is no controller; an empty list cannot be sent to a node
NOBODY = "nobody"

# those that take the scenario's sample time
TIMED = frozenset(NODES) - {"recorder", "replayer", "panel"}


class UnknownNodeError(StationError):
    """A node that this package does not have."""


def entry(executable: str) -> Callable[[Sequence[str] | None], int]:
    """`main` of an executable. Raises UnknownNodeError."""
    return _module(executable).main


def installed() -> tuple[str, ...]:
    """The nodes that this installation has."""
    panel = f"{__package__.removesuffix('.nodes')}.panel"
    return tuple(name for name in NODES if name != "panel" or importlib.util.find_spec(panel) is not None)


def factory(executable: str) -> Callable[[Any], Any]:
    """What makes the executable's own half from a node, for several nodes in one process. Raises UnknownNodeError."""
    module = _module(executable)
    if hasattr(module, "make"):
        return module.make
    # one class named after its file
    return getattr(module, executable.title().replace("_", ""))


def _module(executable: str) -> Any:
    if executable not in NODES:
        raise UnknownNodeError(f"there is no node {executable!r}; there are {', '.join(NODES)}.")
    # the operator's page is a package of its own
    name = (
        f"{__package__}.{executable}" if executable != "panel" else f"{__package__.removesuffix('.nodes')}.panel.node"
    )
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name != name:
            raise
        raise UnknownNodeError(f"the node {executable} is not part of this installation.") from None


# those that show when they are ready
SIGNING = frozenset(NODES) - {"daq_bridge", "recorder", "replayer", "panel"}


def writes(executable: str, parameters: Mapping[str, Any]) -> tuple[str, ...]:
    """Topics of the samples' way that a node writes and may wait for readers of."""
    if executable == "load_generator":
        return (f"{parameters.get('channel', 'load')}/setpoint",)
    return {
        "daq_bridge": ("object/state",),
        "pressure_controller": ("load/command",),
        "position_controller": ("position/command",),
        "twin_simulator": ("twin/state",),
        "shadow_compare": ("shadow/residual",),
    }.get(executable, ())


def reads(executable: str, parameters: Mapping[str, Any]) -> tuple[str, ...]:
    """Topics of the samples' way that a node reads."""
    if executable == "twin_simulator" and parameters.get("feed", "commands") == "setpoints":
        return ("object/state", "load/setpoint", "position/setpoint")
    if executable == "daq_bridge":
        follows = {"twin": "twin/state", "shadow": "shadow/residual"}
        followed = [follows[name] for name in parameters.get("followers", ()) if name in follows]
        return ("load/command", "position/command", *followed)
    if executable == "recorder":
        return tuple(topic for topic in _RECORDED if topic in (parameters.get("topics") or _RECORDED))
    return {
        "load_generator": ("object/state",),
        "pressure_controller": ("object/state", "load/setpoint"),
        "position_controller": ("object/state", "position/setpoint"),
        "twin_simulator": ("object/state",),
        "shadow_compare": ("object/state", "twin/state"),
    }.get(executable, ())


_RECORDED = (
    "object/state",
    "load/setpoint",
    "position/setpoint",
    "load/command",
    "position/command",
    "twin/state",
    "shadow/residual",
)
