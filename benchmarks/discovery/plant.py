"""The hidden object: the paper's models (1), (5), (6) at a fine step, its loops and its imperfections."""

from dataclasses import dataclass

import numpy as np
import scipy.signal
from numba import njit
from numpy.typing import NDArray

from .forms import COULOMB, STATES, at_sensor, at_voltage, speed_loss

Array = NDArray[np.float64]

SAMPLE_S = 0.02
FINE_S = 0.0005
REST_MPA = 1.0
PRESSURE_NUM = (295.1, -2.944e4, 7.457e6, -1.267e8, 3.217e10)
PRESSURE_DEN = (1.0, 159.3, 1.962e4, 1.479e6, 7.247e7, 2.244e9, 3.242e10)
POSITION_GAIN, POSITION_POLE = 206.4 / 23.34, 23.34
DISTURBANCE_NUM = (64.72, -16.45)
DISTURBANCE_DEN = (1.0, 76.54, 2009.0, 0.0)
LOAD_LIMITS_V = (0.0, 5.0)
SERVO_LIMITS_V = (-10.0, 10.0)


@dataclass(frozen=True, slots=True)
class Slot:
    """One imperfection on one channel (0 pressure, 1 position)."""

    channel: int
    code: int
    numbers: tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Nominals:
    """How far the object's own parameters lie from the paper's (factors)."""

    pressure_gain: float = 1.0
    pressure_time: float = 1.0
    position_gain: float = 1.0
    position_time: float = 1.0


@dataclass(frozen=True, slots=True)
class Drive:
    """What moves the object: set-points (closed loop) or voltages (open loop), shape (n,), MPa, cm, V."""

    load: Array
    servo: Array
    load_closed: bool
    servo_closed: bool
    control_delay: int
    servo_gain: float = 7.1545
    start_cm: float = 0.0
    bipolar_load: bool = False


def _fine(
    num: tuple[float, ...], den: tuple[float, ...], gain: float, stretch: float, astatic: bool
) -> tuple[Array, Array, Array]:
    """Exact step of num/den over FINE_S; `stretch` slows the poles, keeping the (integrator's) gain."""
    n, m = np.array(num, float), np.array(den, float)
    n = n * stretch ** np.arange(len(n) - 1, -1, -1)
    m = m * stretch ** np.arange(len(m) - 1, -1, -1)
    if astatic:
        m = m / stretch
    a, b, c, _ = scipy.signal.tf2ss(gain * n, m)
    # Balanced by powers of a typical pole: the companion form spans ten decades.
    w = 20.0 ** np.arange(len(a) - 1, -1, -1)
    a, b, c = a * w[None, :] / w[:, None], b / w[:, None], c * w[None, :]
    ad, bd, *_ = scipy.signal.cont2discrete((a, b, c, np.zeros((1, 1))), FINE_S)
    return np.ascontiguousarray(ad), np.ascontiguousarray(bd[:, 0]), np.ascontiguousarray(c[0])


@njit(cache=True)
def _dot(a: Array, b: Array) -> float:
    total = 0.0
    for i in range(len(b)):
        total += a[i] * b[i]
    return total


@njit(cache=True)
def _advance(a: Array, b: Array, u: float, x: Array, spare: Array) -> None:
    """Step the state: x becomes a x + b u."""
    for i in range(len(b)):
        total = b[i] * u
        for j in range(len(b)):
            total += a[i, j] * x[j]
        spare[i] = total
    for i in range(len(b)):
        x[i] = spare[i]


@njit(cache=True)
def _simulate(  # noqa: PLR0917
    load: Array, servo: Array, load_closed: bool, servo_closed: bool, delay: int, servo_gain: float, start_cm: float,
    load_low: float, pa: Array, pb: Array, pc: Array, da: Array, db: Array, dc: Array, gain: float, lag: float,
    channels: Array, codes: Array, numbers: Array, noise_p: Array, noise_x: Array, sub: int, h: float,
) -> Array:  # fmt: skip
    n, slots = len(load), len(codes)
    out = np.zeros((4, n))
    xp, xd = np.zeros(len(pb)), np.zeros(len(db))
    spare = np.zeros(len(pb))
    share = 1.0 - np.exp(-h / lag)
    x, v = start_cm, 0.0
    state = np.zeros((slots, STATES))
    ctx_load, ctx_servo = np.zeros(4), np.zeros(4)
    ul = us = wait_l = wait_s = 0.0
    integral_l = last_l = last_s = 0.0
    y_p, y_x = 0.0, start_cm
    for k in range(n):
        t = k * sub * h
        y_p = _dot(pc, xp)
        y_x = x + _dot(dc, xd)
        for i in range(slots):
            if codes[i] >= 70:
                a, b, c, d = numbers[i]
                if channels[i] == 0:
                    y_p = at_sensor(codes[i], a, b, c, d, y_p, t, h if k else 0.0, state[i])
                else:
                    y_x = at_sensor(codes[i], a, b, c, d, y_x, t, h if k else 0.0, state[i])
        m_p, m_x = y_p + 1.0 + noise_p[k], y_x + noise_x[k]
        new_l, new_s = load[k], servo[k]
        if load_closed:
            e = load[k] - m_p
            raw = integral_l + 0.2861 * e - 0.1595 * last_l
            new_l = min(max(raw, load_low), 5.0)
            integral_l, last_l = new_l, e
        if servo_closed:
            e = servo[k] - m_x
            rate = (e - last_s) / (sub * h) if k else 0.0
            new_s = min(max(servo_gain * (e + 0.02059 * rate), -10.0), 10.0)
            last_s = e
        if delay and (load_closed or servo_closed):
            ul, wait_l = wait_l, new_l
            us, wait_s = wait_s, new_s
            if not load_closed:
                ul = new_l
            if not servo_closed:
                us = new_s
        else:
            ul, us = new_l, new_s
        out[0, k], out[1, k], out[2, k], out[3, k] = ul, us, m_p, m_x
        for j in range(sub):
            t = (k * sub + j) * h
            p = _dot(pc, xp)
            z = x + _dot(dc, xd)
            ctx_load[0], ctx_load[1], ctx_load[2], ctx_load[3] = p, z, v, us
            ctx_servo[0], ctx_servo[1], ctx_servo[2], ctx_servo[3] = p, z, v, ul
            el, es = ul, us
            loss, stick = 0.0, 0.0
            for i in range(slots):
                a, b, c, d = numbers[i]
                if codes[i] < 50:
                    if channels[i] == 0:
                        el = at_voltage(codes[i], a, b, c, d, el, t, h, ctx_load, state[i])
                    else:
                        es = at_voltage(codes[i], a, b, c, d, es, t, h, ctx_servo, state[i])
                elif codes[i] == COULOMB:
                    stick = a
                elif codes[i] < 70:
                    loss += speed_loss(codes[i], a, b, c, d, z, v, p, h, state[i])
                elif j:
                    # Sensors with memory live at the fine step too.
                    if channels[i] == 0:
                        at_sensor(codes[i], a, b, c, d, p, t, h, state[i])
                    else:
                        at_sensor(codes[i], a, b, c, d, z, t, h, state[i])
            trial = v + share * (gain * es - v - loss)
            hold = share * stick
            before = v
            v = trial - hold if trial > hold else (trial + hold if trial < -hold else 0.0)
            x += 0.5 * h * (before + v)
            _advance(da, db, p, xd, spare)
            _advance(pa, pb, el, xp, spare)
    return out


def simulate(drive: Drive, slots: tuple[Slot, ...], nominals: Nominals, noise_p: Array, noise_x: Array) -> Array:
    """Rows load voltage, servo voltage (V), pressure (MPa), position (cm), each (n,); noise in MPa and cm."""
    pa, pb, pc = _fine(PRESSURE_NUM, PRESSURE_DEN, nominals.pressure_gain, nominals.pressure_time, False)
    da, db, dc = _fine(DISTURBANCE_NUM, DISTURBANCE_DEN, 1.0, 1.0, True)
    return _simulate(
        drive.load, drive.servo, drive.load_closed, drive.servo_closed, drive.control_delay, drive.servo_gain,
        drive.start_cm, -5.0 if drive.bipolar_load else LOAD_LIMITS_V[0], pa, pb, pc, da, db, dc,
        POSITION_GAIN * nominals.position_gain, nominals.position_time / POSITION_POLE,
        np.array([s.channel for s in slots], np.int64), np.array([s.code for s in slots], np.int64),
        np.array([s.numbers for s in slots], float).reshape(len(slots), 4), noise_p, noise_x,
        round(SAMPLE_S / FINE_S), FINE_S,
    )  # fmt: skip
