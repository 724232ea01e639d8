"""Controllers: PI, PID and fuzzy laws in loops with limits, anti-windup and bumpless change."""

from .config import AntiWindup, ControlError, Limits, LoopConfig, PiConfig, PidConfig
from .fuzzy_config import FuzzyConfig, FuzzyVariable
from .fuzzy_surface import FuzzySurface, infer, memberships, surface
from .loop import LoopController, LoopState
from .signals import ControlInput, ControlOutput

__all__ = [
    "AntiWindup",
    "ControlError",
    "ControlInput",
    "ControlOutput",
    "FuzzyConfig",
    "FuzzySurface",
    "FuzzyVariable",
    "Limits",
    "LoopConfig",
    "LoopController",
    "LoopState",
    "PiConfig",
    "PidConfig",
    "infer",
    "memberships",
    "surface",
]
