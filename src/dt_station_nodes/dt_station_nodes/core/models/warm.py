"""Compile everything once, so that no interactive command waits for it; run as a module by the entry script."""

import numpy as np

from ..channels import Channel
from .effects import registry
from .plant import ModelInput, PlantModel
from .spec import ModelSpec, PathSpec


def warm() -> int:
    """Run a small model through the kernel with every effect loaded; returns how many effects there are."""
    path = PathSpec(numerator=(1.0,), denominator=(1.0, 1.0))
    spec = ModelSpec(name="warm", paths={Channel.PRESSURE: path, Channel.POSITION: path})
    model = PlantModel(spec, 0.02)
    model.step(model.initial_state(), ModelInput(0.0, 0.0))
    model.simulate(np.zeros(2), np.zeros(2), np.zeros(2))
    return len(registry())


if __name__ == "__main__":
    warm()
