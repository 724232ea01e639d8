"""Models of the object: readable YAML, exact linear paths, compiled effects, one kernel."""

from .linear import coefficients, real_poles
from .plant import ModelInput, ModelOutput, ModelState, PlantModel, Simulation
from .prepare import LONGEST_SUBSTEP_S
from .single import PathSimulator, at_places
from .spec import DisturbanceSpec, EffectSpec, ModelError, ModelSpec, Outlet, PathSpec, TransferFunction

__all__ = [
    "LONGEST_SUBSTEP_S",
    "DisturbanceSpec",
    "EffectSpec",
    "ModelError",
    "ModelInput",
    "ModelOutput",
    "ModelSpec",
    "ModelState",
    "Outlet",
    "PathSimulator",
    "PathSpec",
    "PlantModel",
    "Simulation",
    "TransferFunction",
    "at_places",
    "coefficients",
    "real_poles",
]
