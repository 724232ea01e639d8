"""Compile every numba kernel into its cache, so that no verb waits for it; the entry script runs this as a program."""

import numpy as np


def warm() -> None:
    """Run each compiled part once on next to nothing."""
    from ..core.models.warm import warm as models
    from ..hardware import open_backend
    from ..identification.propagation import filter_smooth
    from ..identification.static_shape import play

    models()
    rig = open_backend("virtual", {"sample_time_s": 0.02, "rig": "ideal"})
    rig.open()
    rig.read()
    rig.write(1.0, 1.0)
    rig.read()
    rig.close()
    signal = np.zeros(4)
    filter_smooth(np.array([1.0, 2.0, 1.0]), signal, 0.02)
    play(signal, 0.1)


if __name__ == "__main__":
    warm()
