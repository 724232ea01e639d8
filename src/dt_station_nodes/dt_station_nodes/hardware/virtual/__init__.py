"""A physical simulation of the paper's rig; shares nothing with the models that are to describe it."""

from .backend import VirtualBackend
from .config import RigConfig
from .files import load_rig
from .parameters import RigError
from .rig import RigInput, RigOutput, RigState, Truth, VirtualRig

__all__ = [
    "RigConfig",
    "RigError",
    "RigInput",
    "RigOutput",
    "RigState",
    "Truth",
    "VirtualBackend",
    "VirtualRig",
    "load_rig",
]
