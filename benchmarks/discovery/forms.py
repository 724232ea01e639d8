"""What is wrong with a hidden object, as compiled forms; none of them is shared with the candidates of discovery.

A slot is one imperfection: `code`, up to four numbers and a state array. Voltages in V; the position path counts in
cm, cm/s, the pressure path in MPa, as the paper's models do. Sources of the forms: LuGre friction (Canudas de Wit et
al. 1995), Bouc-Wen (Wen 1976), Prandtl-Ishlinskii as a Preisach model of plays (Krejci 1996), orifice flow (Merritt
1967), stiction of a valve (He et al. 2007), a spool that sticks (Karnopp 1985).
"""

import math

import numpy as np
from numba import njit

STATES = 640
RING = 512

# Codes, by where they act: 1-49 on the voltage, 50-69 on the speed, 70-99 on what is measured.
DEAD_SHARP, DEAD_ROUND, SAT_SHARP, SAT_SMOOTH, PLAY_IN, PLAYS_IN, BOUC_WEN = 1, 2, 3, 4, 5, 6, 7
DELAY, DELAY_FLOW, RATE_HARD, RATE_SOFT, GAIN_LOAD, GAIN_LOAD_ROOT = 8, 9, 10, 11, 12, 13
GAIN_SIDE, GAIN_SIDE_SOFT, BIAS, BIAS_WARM, LAG, LAG_TWO, MODE_SERIES, MODE_PARALLEL = 14, 15, 16, 17, 18, 19, 20, 21
DRIFT, DRIFT_WARM, RIPPLE, RIPPLE_RICH, MEMORY, CROSS, STROKE, DROPOUT = 22, 23, 24, 25, 26, 27, 28, 29
DEAD_JUMP, STICK_SLIP, SPOOL = 30, 31, 32
COULOMB, LUGRE, LEAK, LEAK_ROOT, CUBIC, HARDENING, QUADRATIC, LEAK_SAG = 50, 51, 52, 53, 54, 55, 56, 57
PLAY_OUT, PLAY_OUT_SOFT, CLAMP, CLAMP_SOFT, RIPPLE_OUT, FROZEN, AIR = 70, 71, 72, 73, 74, 75, 76


@njit(cache=True)
def _softplus(x: float) -> float:
    return x + math.log1p(math.exp(-x)) if x > 0.0 else math.log1p(math.exp(x))


@njit(cache=True)
def _play(x: float, half: float, z: float) -> float:
    return min(max(z, x - half), x + half)


@njit(cache=True)
def _slowed(u: float, lag: float, h: float, s: np.ndarray, at: int) -> float:
    """Mean of a first-order lag over the step: its end would be half a step early, which tells a lag from a delay."""
    before = s[at]
    s[at] += (u - before) * (1.0 - math.exp(-h / lag))
    return 0.5 * (before + s[at])


@njit(cache=True)
def _mode(u: float, w: float, zeta: float, h: float, s: np.ndarray) -> float:
    """A second-order mode, half-implicit; its states are s[0] (deflection) and s[1] (rate)."""
    s[1] += h * (w * w * (u - s[0]) - 2.0 * zeta * w * s[1])
    s[0] += h * s[1]
    return s[0]


@njit(cache=True)
def at_voltage(
    code: int, a: float, b: float, c: float, d: float, u: float, t: float, h: float, ctx: np.ndarray, s: np.ndarray
) -> float:
    """Voltage after the imperfection; ctx is pressure above rest (MPa), position (cm), speed (cm/s), other voltage."""
    if code == DEAD_SHARP:
        return math.copysign(max(abs(u) - a, 0.0), u)
    if code == DEAD_ROUND:
        r = b * a
        return r * (_softplus((u - a) / r) - _softplus((-u - a) / r))
    if code == DEAD_JUMP:
        return u if abs(u) > a else 0.0
    if code == STICK_SLIP:
        if abs(u - s[0]) > a:
            s[0] = u - math.copysign(b, u - s[0])
        return s[0]
    if code == SPOOL:
        # s[1] is the side it slides to, 0 at rest; a breaks away, b drags, c is its time constant.
        if s[1] == 0.0 and abs(u - s[0]) > a:
            s[1] = math.copysign(1.0, u - s[0])
        push = u - s[0] - s[1] * b
        if push * s[1] <= 0.0:
            s[1] = 0.0
        else:
            s[0] += push * (1.0 - math.exp(-h / c))
        return s[0]
    if code == SAT_SHARP:
        return min(max(u, -a), a)
    if code == SAT_SMOOTH:
        return u / (1.0 + abs(u / a) ** b) ** (1.0 / b)
    if code == PLAY_IN:
        s[0] = _play(u, a, s[0])
        return s[0]
    if code == PLAYS_IN:
        total = 0.0
        for i in range(8):
            s[i] = _play(u, a * (i + 0.5) / 4.0, s[i])
            total += s[i]
        return (1.0 - b) * u + b * total / 8.0
    if code == BOUC_WEN:
        du = u - s[1]
        s[1] = u
        parts = 1 + min(int(abs(du) / (0.05 * a)), 2000)
        for _ in range(parts):
            s[0] += du / parts * (1.0 - (b + (1.0 - b) * math.copysign(1.0, du * s[0])) * abs(s[0] / a) ** c)
        return u - s[0]
    if code in (DELAY, DELAY_FLOW):
        k = int(s[RING])
        s[k % RING] = u
        s[RING] = k + 1
        lag = a / h
        if code == DELAY_FLOW:
            lag *= 1.0 + b * math.tanh(abs(u) / c)
        whole = int(lag)
        part = lag - whole
        new = s[(k - whole) % RING] if k >= whole else 0.0
        old = s[(k - whole - 1) % RING] if k >= whole + 1 else 0.0
        return (1.0 - part) * new + part * old
    if code == RATE_HARD:
        s[0] += min(max(u - s[0], -a * h), a * h)
        return s[0]
    if code == RATE_SOFT:
        s[0] += h * a * math.tanh((u - s[0]) / (a * b))
        return s[0]
    if code == GAIN_LOAD:
        return u * (1.0 - a * ctx[0])
    if code == GAIN_LOAD_ROOT:
        return u * math.sqrt(max(1.0 - a * math.copysign(1.0, u) * ctx[0], 0.02))
    if code == GAIN_SIDE:
        return u * (a if u < 0.0 else b)
    if code == GAIN_SIDE_SOFT:
        return u * (1.0 + a * math.tanh(u / b))
    if code == BIAS:
        return u + a
    if code == BIAS_WARM:
        return u + a * (1.0 - b * math.exp(-t / c))
    if code == LAG:
        return _slowed(u, a, h, s, 0)
    if code == LAG_TWO:
        return _slowed(_slowed(u, 0.6 * a, h, s, 0), 0.4 * a, h, s, 1)
    if code == MODE_SERIES:
        return _mode(u, a, b, h, s)
    if code == MODE_PARALLEL:
        return (1.0 - c) * u + c * _mode(u, a, b, h, s)
    if code == DRIFT:
        return u * (1.0 + a * t / b)
    if code == DRIFT_WARM:
        return u * (1.0 + a * (1.0 - math.exp(-t / b)))
    if code == RIPPLE:
        return u + a * math.sin(2.0 * math.pi * b * t + c)
    if code == RIPPLE_RICH:
        p = 2.0 * math.pi * b * t + c
        return u + a * (math.sin(p) + 0.35 * math.sin(2.0 * p + 1.0) + 0.15 * math.sin(3.0 * p))
    if code == MEMORY:
        s[0] += h / b * (abs(u) / c - s[0])
        return u * (1.0 - a * min(s[0], 3.0))
    if code == CROSS:
        s[0] += h / b * (ctx[3] - s[0])
        return u + a * (ctx[3] - s[0])
    if code == STROKE:
        return u * (1.0 + a * math.tanh(ctx[1] / b))
    if code == DROPOUT:
        # One cut in every period b, of length a, at a place that wanders by the golden ratio.
        k = math.floor(t / b)
        at = b * (k + 0.1 + 0.8 * ((k + 1.0) * 0.6180339887 % 1.0) * (1.0 - a / b))
        return 0.0 if at <= t < at + a else u
    return u


@njit(cache=True)
def speed_loss(
    code: int, a: float, b: float, c: float, d: float, x: float, v: float, p: float, h: float, s: np.ndarray
) -> float:
    """Speed (cm/s) that the imperfection takes away in the steady state; p is the pressure above rest (MPa)."""
    if code == LUGRE:
        g = a * (1.0 + (b - 1.0) * math.exp(-((v / c) ** 2)))
        s[0] = (s[0] + h * v) / (1.0 + h * abs(v) * d / g)
        return d * s[0]
    if code == LEAK:
        return a * p
    if code == LEAK_ROOT:
        return a * math.copysign(math.sqrt(abs(p)), p)
    if code == LEAK_SAG:
        return a * (x - b)
    if code == CUBIC:
        return a * (x - b) ** 3
    if code == HARDENING:
        return a * (math.sinh((x - b) / c) - (x - b) / c)
    if code == QUADRATIC:
        return a * v * abs(v)
    return 0.0


@njit(cache=True)
def at_sensor(code: int, a: float, b: float, c: float, d: float, y: float, t: float, h: float, s: np.ndarray) -> float:
    """Measured quantity (MPa above rest, or cm) after the imperfection."""
    if code == PLAY_OUT:
        if s[1] == 0.0:
            s[0], s[1] = y, 1.0
        s[0] = _play(y, a, s[0])
        return s[0]
    if code == PLAY_OUT_SOFT:
        if s[1] == 0.0:
            s[0], s[1] = y, 1.0
        s[0] += (_play(y, a, s[0]) - s[0]) * (1.0 - math.exp(-h / b))
        return s[0]
    if code == CLAMP:
        return min(max(y, b), a)
    if code == CLAMP_SOFT:
        return a - c * _softplus((a - y) / c)
    if code == RIPPLE_OUT:
        return y + a * math.sin(2.0 * math.pi * b * t + c)
    if code == FROZEN:
        k = math.floor(t / b)
        at = b * (k + 0.1 + 0.8 * ((k + 1.0) * 0.6180339887 % 1.0) * (1.0 - a / b))
        if not (at <= t < at + a):
            s[0] = y
        return s[0]
    if code == AIR:
        s[0] += (y - s[0]) * (1.0 - math.exp(-h / (a / (0.15 + max(y, 0.0) / b) ** 1.2)))
        return s[0]
    return y
