"""From a rig's configuration to the kernel's numbers and the state in which the rig rests."""

from collections.abc import Callable
from math import pi
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from ...core.errors import StationError
from . import kernel as k
from .config import Hysteresis, RigConfig

Array = NDArray[np.float64]


class RigError(StationError):
    """A rig file or a rig that cannot be simulated."""


def parameters(config: RigConfig, sample_time_s: float) -> Array:
    """The kernel's parameters at a sample time, shape (PARAMETERS,); RigError where no rest state exists."""
    count = max(1, int(np.ceil(sample_time_s / config.longest_substep_s - 1e-9)))
    substep = sample_time_s / count
    servo, relief, axis = config.servo_valve, config.relief_valve, config.axis
    a1, a2 = config.tested_cylinder, config.load_cylinder
    p = np.zeros(k.PARAMETERS)
    p[[k.SUBSTEP, k.SUBSTEPS, k.BULK, k.AIR]] = substep, count, config.oil.bulk_modulus_pa, config.oil.air_fraction
    p[k.A1_CAP] = _disc(a1.piston_diameter_m)
    p[k.A1_ROD] = _disc(a1.piston_diameter_m) - _disc(a1.rod_diameter_m)
    p[k.A2_CAP] = _disc(a2.piston_diameter_m)
    p[[k.V1_CAP, k.V1_ROD, k.V2_CAP]] = a1.cap_dead_volume_m3, a1.rod_dead_volume_m3, a2.cap_dead_volume_m3
    p[k.HALF_STROKE] = min(a1.stroke_m, a2.stroke_m) / 2
    p[[k.STOP, k.MASS, k.VISCOUS]] = axis.stop_stiffness_n_m, axis.moving_mass_kg, axis.viscous_friction_n_s_m
    friction = config.friction
    p[[k.COULOMB, k.STATIC, k.STRIBECK]] = 1.0, 1.0, 1.0
    if friction is not None and friction.coulomb_n > 0.0:
        p[[k.COULOMB, k.STATIC]] = friction.coulomb_n, friction.static_n
        p[k.STRIBECK] = friction.stribeck_velocity_m_s
        p[[k.SIGMA0, k.SIGMA1]] = friction.bristle_stiffness_n_m, friction.bristle_damping_n_s_m
    p[[k.FRAME_W, k.FRAME_D]] = 1.0, 1.0
    if config.frame is not None:
        p[k.FRAME_C] = config.frame.compliance_m_n
        p[[k.FRAME_W, k.FRAME_D]] = config.frame.natural_frequency_rad_s, config.frame.damping_ratio
    p[k.SERVO_K] = servo.rated_flow_m3_s / servo.rated_voltage_v / np.sqrt(servo.rated_drop_pa)
    p[[k.OVERLAP, k.ROUNDING, k.NULL_SHIFT]] = servo.overlap_v, servo.rounding_v, servo.null_shift_v_pa
    p[[k.SPOOL_W, k.SPOOL_D]] = servo.spool_frequency_rad_s, servo.spool_damping_ratio
    p[[k.SERVO_LAG, k.SERVO_LIMIT]] = _lag(servo.amplifier_lag_s, substep), servo.amplifier_limit_v
    p[k.SERVO_DELAY] = _delay(servo.delay_s, substep, sample_time_s)
    p[[k.PISTON_LEAK, k.SUPPLY]] = servo.piston_leakage_m3_s_pa, servo.supply_pressure_pa
    p[[k.REST, k.RELIEF_GAIN]] = relief.rest_pressure_pa, relief.gain_pa_v
    p[[k.OPENING, k.RELIEF_ROUNDING]] = relief.opening_v, relief.rounding_v
    p[k.OVERRIDE] = relief.override_pa_s_m3
    p[[k.CRACK_W, k.CRACK_D]] = relief.armature_frequency_rad_s, relief.armature_damping_ratio
    p[[k.RELIEF_LAG, k.RELIEF_LIMIT]] = _lag(relief.amplifier_lag_s, substep), relief.amplifier_limit_v
    p[k.RELIEF_DELAY] = _delay(relief.delay_s, substep, sample_time_s)
    p[k.MIDDLE] = relief.amplifier_limit_v / 2
    if relief.hysteresis is not None:
        p[k.END_SHARE] = relief.hysteresis.end_share
        p[k.WIDTHS : k.WIDTHS + k.HALF_WIDTHS] = _half_widths(relief.hysteresis)
    p[[k.PUMP, k.PUMP_SLIP, k.PUMP_LIMIT]] = relief.pump_flow_m3_s, relief.pump_slip_m3_s_pa, relief.pump_limit_pa
    p[k.FLUX_LAG] = _lag(relief.flux_lag_s, substep)
    p[k.PRESSURE_LAG] = _lag(config.pressure_sensor.lag_s, substep)
    p[k.POSITION_LAG] = _lag(config.position_sensor.lag_s, substep)
    p[k.FRAME_REST] = p[k.FRAME_C] * p[k.A2_CAP] * p[k.REST]
    _trim(p)
    return p


def rest_state(config: RigConfig, p: Array) -> Array:
    """The state in which the rig stands still at 0 V and rest pressure, demagnetised, shape (STATE_SIZE,)."""
    s = np.zeros(k.STATE_SIZE)
    s[k.X] = config.axis.start_position_m
    s[k.POSITION_SENSOR] = config.axis.start_position_m
    s[[k.LOAD, k.PRESSURE_SENSOR]] = p[k.REST]
    s[k.CRACK] = k.crack_pressure(p, 0.0)
    s[k.FRAME] = p[k.FRAME_REST]
    s[k.ROD] = _rod_pressure(p, p[k.NULL])
    s[k.CAP] = _cap_pressure(p, s[k.ROD])
    return s


def _trim(p: Array) -> None:
    """Set the valves' mechanical null screws so that the rig rests at 0 V: no drift, the rest pressure."""
    # The rest pressure is that of demagnetised iron; it includes what the rounding leaves at 0 V.
    pump = max(p[k.PUMP] - p[k.PUMP_SLIP] * p[k.REST], 0.0)
    p[k.CRACK_REST] = p[k.REST] - p[k.OVERRIDE] * pump
    p[k.CRACK_REST] -= k.crack_pressure(p, 0.0) - p[k.CRACK_REST]

    def imbalance(null: float) -> float:
        rod = _rod_pressure(p, null)
        return k.servo_flows(p, null, _cap_pressure(p, rod), rod)[0]

    reach = p[k.OVERLAP] + 30.0 * p[k.ROUNDING]
    if imbalance(-reach) * imbalance(reach) > 0.0:
        raise RigError("the servo valve cannot hold the load at rest: raise servo_valve.supply_pressure_pa")
    p[k.NULL] = _root(imbalance, -reach, reach)


def _half_widths(hysteresis: Hysteresis) -> Array:
    """Half-widths (V) of equally many hysterons each, log-normal about a mean of `half_width_v`."""
    normal = NormalDist()
    shares = [(i + 0.5) / k.HALF_WIDTHS for i in range(k.HALF_WIDTHS)]
    widths = np.exp(hysteresis.spread * np.array([normal.inv_cdf(share) for share in shares]))
    return np.asarray(hysteresis.half_width_v * widths / widths.mean())


def _cap_pressure(p: Array, rod: float) -> float:
    return float((p[k.A2_CAP] * p[k.REST] + p[k.A1_ROD] * rod) / p[k.A1_CAP])


def _rod_pressure(p: Array, null: float) -> float:
    def inflow(rod: float) -> float:
        return k.servo_flows(p, null, _cap_pressure(p, rod), rod)[1]

    return _root(inflow, -0.5 * p[k.SUPPLY], 1.5 * p[k.SUPPLY])


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a function changes sign between two points, by bisection to the last bit (scipy is slow to import)."""
    rises = function(high) > function(low)
    while True:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            return middle
        if (function(middle) > 0.0) == rises:
            high = middle
        else:
            low = middle


def _disc(diameter_m: float) -> float:
    return pi * diameter_m * diameter_m / 4


def _lag(lag_s: float, substep_s: float) -> float:
    # A lag below the sub-step is none; a smaller number would make the explicit step overshoot.
    return max(lag_s, substep_s)


def _delay(delay_s: float, substep_s: float, sample_time_s: float) -> int:
    if delay_s > (k.HISTORY_SAMPLES - 2) * sample_time_s:
        raise RigError(
            f"a delay of {delay_s} s needs a sample time of at least {delay_s / (k.HISTORY_SAMPLES - 2):.3g} s"
        )
    return round(delay_s / substep_s)
