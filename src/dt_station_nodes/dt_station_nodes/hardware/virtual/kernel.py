"""The compiled physics of the rig: fixed sub-steps, velocity before position (symplectic), friction implicit.

Axis: x in m from mid-stroke, positive where the load pushes (A1 in, A2 out), the direction of the kick in the paper's
equation (6). Pressures are gauge, in Pa; spool and coil in volts of command. Everything compiled is in this one file,
since a cached function does not notice that one it calls in another file has changed.
"""

from math import sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

ATMOSPHERE_PA = 101325.0
# Below this drop an orifice is laminar; it also keeps its slope finite.
LAMINAR_PA = 1.0e5

# Places in the state; MEMORY holds what the hysterons of each half-width remember, HISTORY the last samples'
# voltages, newest first, load and servo by turns.
SEQUENCE, X, V, BRISTLE, CAP, ROD, LOAD, SPOOL, SPOOL_RATE, SERVO_AMPLIFIER, COIL, FLUX = range(12)
CRACK, CRACK_RATE, FRAME, FRAME_RATE, PRESSURE_SENSOR, POSITION_SENSOR, MEMORY = range(12, 19)
HALF_WIDTHS = 16
HISTORY = MEMORY + HALF_WIDTHS
HISTORY_SAMPLES = 64
STATE_SIZE = HISTORY + 2 * HISTORY_SAMPLES

# Places in the parameters.
SUBSTEP, SUBSTEPS, BULK, AIR, A1_CAP, A1_ROD, A2_CAP, V1_CAP, V1_ROD, V2_CAP, HALF_STROKE, STOP = range(12)
MASS, VISCOUS, COULOMB, STATIC, STRIBECK, SIGMA0, SIGMA1, FRAME_C, FRAME_W, FRAME_D = range(12, 22)
SERVO_K, OVERLAP, ROUNDING, NULL, NULL_SHIFT, SPOOL_W, SPOOL_D, SERVO_LAG, SERVO_LIMIT, SERVO_DELAY = range(22, 32)
PISTON_LEAK, SUPPLY, REST, RELIEF_GAIN, OPENING, RELIEF_ROUNDING, OVERRIDE, CRACK_REST, CRACK_W, CRACK_D = range(32, 42)
RELIEF_LAG, RELIEF_LIMIT, RELIEF_DELAY, END_SHARE, MIDDLE, PUMP, PUMP_SLIP, PUMP_LIMIT = range(42, 50)
PRESSURE_LAG, POSITION_LAG, FRAME_REST, FLUX_LAG, WIDTHS = range(50, 55)
PARAMETERS = WIDTHS + HALF_WIDTHS


@njit(cache=True)
def opening(command: float, overlap: float, rounding: float) -> float:
    """Width of a metering edge: zero below the overlap, rounded by wear and clearance."""
    beyond = command - overlap
    return 0.5 * (beyond + sqrt(beyond * beyond + rounding * rounding))


@njit(cache=True)
def orifice(drop: float) -> float:
    """Signed square root of a pressure drop, laminar near zero, sqrt(Pa)."""
    return drop / sqrt(abs(drop) + LAMINAR_PA)


@njit(cache=True)
def modulus(pressure: float, bulk: float, air: float) -> float:
    """Effective bulk modulus of oil that carries air, Pa (Merritt 1967, chapter 2)."""
    absolute = max(pressure + ATMOSPHERE_PA, 10.0)
    return bulk / (1.0 + bulk * air * ATMOSPHERE_PA / (absolute * absolute))


@njit(cache=True)
def servo_flows(p: Array, spool: float, cap: float, rod: float) -> tuple[float, float]:
    """Flows into the cap and rod chambers of A1, m^3/s; a positive spool fills the rod side."""
    wide = p[SERVO_K] * opening(spool, p[OVERLAP], p[ROUNDING])
    narrow = p[SERVO_K] * opening(-spool, p[OVERLAP], p[ROUNDING])
    leak = p[PISTON_LEAK] * (cap - rod)
    into_cap = narrow * orifice(p[SUPPLY] - cap) - wide * orifice(cap) - leak
    into_rod = wide * orifice(p[SUPPLY] - rod) - narrow * orifice(rod) + leak
    return into_cap, into_rod


@njit(cache=True)
def load_flow(p: Array, load: float, crack: float) -> float:
    """Flow into the upper chamber of A2, m^3/s: the pump's through its check valve, less the relief valve's."""
    share = min(max(1.0 - (load - p[PUMP_LIMIT]) / 5.0e5, 0.0), 1.0)
    pump = max(p[PUMP] - p[PUMP_SLIP] * load, 0.0) * share
    lift = max(load - crack, 0.0)
    return pump - lift / p[OVERRIDE] * sqrt(max(load, 0.0) / p[REST])


@njit(cache=True)
def magnetised(p: Array, s: Array, coil: float) -> float:
    """The coil's voltage less what the iron remembers of its way there, V; moves the memory in `s`.

    Preisach model in Krejci's form: hysterons of half-width r that are up are those centred below one level, which
    the coil drags along once it is r away. Their number up to a level y is N(y) = y - end_share z^3 / (3 middle^2),
    z = y - middle: fewer at either end of the range. What they lack there is reversible, so that the curve midway
    between the branches is straight.
    """
    remembered = 0.0
    for i in range(HALF_WIDTHS):
        level = min(max(s[MEMORY + i], coil - p[WIDTHS + i]), coil + p[WIDTHS + i])
        s[MEMORY + i] = level
        remembered += _hysterons(p, level)
    return coil + remembered / HALF_WIDTHS - _hysterons(p, coil)


@njit(cache=True)
def _hysterons(p: Array, level: float) -> float:
    z = level - p[MIDDLE]
    return level - p[END_SHARE] * z * z * z / (3.0 * p[MIDDLE] * p[MIDDLE])


@njit(cache=True)
def crack_pressure(p: Array, flux: float) -> float:
    """Pressure at which the relief valve starts to open once its armature is at rest, Pa; flux in volts of command."""
    return p[CRACK_REST] + p[RELIEF_GAIN] * opening(flux, p[OPENING], p[RELIEF_ROUNDING])


@njit(cache=True)
def advance(p: Array, s: Array, load_v: float, servo_v: float) -> None:
    """One sample time with the voltages held; `s` is changed in place."""
    dt = p[SUBSTEP]
    n = int(p[SUBSTEPS])
    for i in range(STATE_SIZE - 1, HISTORY + 1, -1):
        s[i] = s[i - 2]
    s[HISTORY], s[HISTORY + 1] = load_v, servo_v
    # A held voltage delayed: the older of two neighbours until the change arrives within this sample.
    load_back, load_switch = int(p[RELIEF_DELAY]) // n, int(p[RELIEF_DELAY]) % n
    servo_back, servo_switch = int(p[SERVO_DELAY]) // n, int(p[SERVO_DELAY]) % n
    load_new, load_old = s[HISTORY + 2 * load_back], s[HISTORY + 2 * load_back + 2]
    servo_new, servo_old = s[HISTORY + 2 * servo_back + 1], s[HISTORY + 2 * servo_back + 3]

    x, v, bristle, cap, rod, load = s[X], s[V], s[BRISTLE], s[CAP], s[ROD], s[LOAD]
    spool, spool_rate, amplifier, coil, flux = s[SPOOL], s[SPOOL_RATE], s[SERVO_AMPLIFIER], s[COIL], s[FLUX]
    crack, crack_rate, frame, frame_rate = s[CRACK], s[CRACK_RATE], s[FRAME], s[FRAME_RATE]
    sensed_pressure, sensed_position = s[PRESSURE_SENSOR], s[POSITION_SENSOR]
    half = p[HALF_STROKE]

    for j in range(n):
        servo_in = min(max(servo_old if j < servo_switch else servo_new, -p[SERVO_LIMIT]), p[SERVO_LIMIT])
        load_in = min(max(load_old if j < load_switch else load_new, 0.0), p[RELIEF_LIMIT])

        # Electrics, spool and armature.
        amplifier += dt / p[SERVO_LAG] * (servo_in - amplifier)
        spool_rate += dt * (p[SPOOL_W] * p[SPOOL_W] * (amplifier - spool) - 2.0 * p[SPOOL_D] * p[SPOOL_W] * spool_rate)
        spool += dt * spool_rate
        coil += dt / p[RELIEF_LAG] * (load_in - coil)
        flux += dt / p[FLUX_LAG] * (magnetised(p, s, coil) - flux)
        target = crack_pressure(p, flux)
        crack_rate += dt * (p[CRACK_W] * p[CRACK_W] * (target - crack) - 2.0 * p[CRACK_D] * p[CRACK_W] * crack_rate)
        crack += dt * crack_rate

        # Forces; friction's bristle is implicit in its own decay.
        curve = p[COULOMB] + (p[STATIC] - p[COULOMB]) / (1.0 + (v / p[STRIBECK]) ** 2)
        before = bristle
        bristle = (bristle + dt * v) / (1.0 + dt * p[SIGMA0] * abs(v) / curve)
        friction = p[SIGMA0] * bristle + p[SIGMA1] * (bristle - before) / dt + p[VISCOUS] * v
        stop = 0.0
        if x > half:
            stop = max(p[STOP] * (x - half) + 1.0e5 * v, 0.0)
        elif x < -half:
            stop = min(p[STOP] * (x + half) + 1.0e5 * v, 0.0)
        holding = p[A1_CAP] * cap - p[A1_ROD] * rod
        v += dt / p[MASS] * (p[A2_CAP] * load - holding - friction - stop)
        x += dt * v
        frame_rate += dt * p[FRAME_W] * (p[FRAME_W] * (p[FRAME_C] * holding - frame) - 2.0 * p[FRAME_D] * frame_rate)
        frame += dt * frame_rate

        # Flows and compression.
        into_cap, into_rod = servo_flows(p, spool + p[NULL] - p[NULL_SHIFT] * (load - p[REST]), cap, rod)
        into_load = load_flow(p, load, crack)
        cap_volume = p[V1_CAP] + p[A1_CAP] * (half - x)
        rod_volume = p[V1_ROD] + p[A1_ROD] * (half + x)
        load_volume = p[V2_CAP] + p[A2_CAP] * (half + x + frame)
        cap += dt * modulus(cap, p[BULK], p[AIR]) / cap_volume * (into_cap + p[A1_CAP] * v)
        rod += dt * modulus(rod, p[BULK], p[AIR]) / rod_volume * (into_rod - p[A1_ROD] * v)
        squeezed = p[A2_CAP] * (v + frame_rate)
        load += dt * modulus(load, p[BULK], p[AIR]) / load_volume * (into_load - squeezed)

        sensed_pressure += dt / p[PRESSURE_LAG] * (load - sensed_pressure)
        sensed_position += dt / p[POSITION_LAG] * (x + frame - p[FRAME_REST] - sensed_position)

    s[SEQUENCE] += 1.0
    s[X], s[V], s[BRISTLE], s[CAP], s[ROD], s[LOAD] = x, v, bristle, cap, rod, load
    s[SPOOL], s[SPOOL_RATE], s[SERVO_AMPLIFIER], s[COIL], s[FLUX] = spool, spool_rate, amplifier, coil, flux
    s[CRACK], s[CRACK_RATE], s[FRAME], s[FRAME_RATE] = crack, crack_rate, frame, frame_rate
    s[PRESSURE_SENSOR], s[POSITION_SENSOR] = sensed_pressure, sensed_position
