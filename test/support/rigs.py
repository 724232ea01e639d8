"""Rigs for these tests: the shipped files, and ways to drive them."""

import numpy as np

from dt_station_nodes.core.run import Run
from dt_station_nodes.hardware.virtual import RigConfig, RigState, VirtualRig, load_rig

FINE_S = 0.005


def changed(config: RigConfig, **parts) -> RigConfig:
    """The rig with keys of its parts changed, as a file with `base` would."""
    data = config.model_dump()
    for part, change in parts.items():
        data[part] = {**data[part], **change} if isinstance(change, dict) and data[part] is not None else change
    return RigConfig.model_validate(data)


def noiseless(config: RigConfig) -> RigConfig:
    return changed(config, pressure_sensor={"noise_rms": 0.0}, position_sensor={"noise_rms": 0.0})


def rig(name: str, sample_time_s: float = FINE_S, **parts) -> VirtualRig:
    return VirtualRig(changed(load_rig(name), **parts), sample_time_s)


def drive(rig: VirtualRig, load_v, servo_v, state: RigState | None = None) -> Run:
    load_v, servo_v = np.broadcast_arrays(np.asarray(load_v, float), np.asarray(servo_v, float))
    return rig.simulate(load_v, servo_v, state)


def settled(rig: VirtualRig, load_v: float, seconds: float = 2.0) -> RigState:
    """The state after a constant load voltage has acted."""
    return rig.after(np.full(round(seconds / rig.sample_time_s), load_v), np.zeros(round(seconds / rig.sample_time_s)))


def triangle(low: float, high: float, seconds: float, sample_time_s: float) -> np.ndarray:
    """Two periods from low to high and back."""
    t = np.arange(round(2 * seconds / sample_time_s)) * sample_time_s
    return low + (high - low) * (1 - np.abs(1 - 2 * ((t / seconds) % 1)))
