"""Runs with a known missing effect, in forms of their own: nothing here is shared with `core.models`.

A fine-step (1 ms) simulation of the paper's three paths with one or two imperfections written in other
forms than the candidates': LuGre friction, Bouc-Wen hysteresis, rounded corners, square-root flow.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.linalg import expm
from scipy.signal import tf2ss

from dt_station_nodes.core.run import Run

STEP_S = 1e-3
SAMPLE_S = 0.02
NAMES = (
    "none dead_zone saturation hysteresis backlash friction delay rate_limit leakage load_dependent_gain "
    "asymmetric_gain bias extra_lag resonance gain_drift periodic_disturbance cubic_stiffness overflow "
    "memory cross_coupling stroke_dependent_gain trapped_air frozen_sensor output_backlash "
).split()
CODE = {name: number for number, name in enumerate(NAMES)}
OUTSIDE = ("memory", "cross_coupling", "stroke_dependent_gain", "trapped_air", "frozen_sensor")


@dataclass(frozen=True)
class Case:
    """What is built into a run: (name, channel, size) each; sizes in the units of `DEFAULTS`."""

    effects: tuple[tuple[str, str, float], ...] = ()
    shape: str = "square"
    noise_db: float = 40.0
    seed: int = 0
    seconds: float = 40.0
    closed: bool = True
    gain_error: float = 0.0
    time_error: float = 0.0


DEFAULTS = {
    ("dead_zone", "position"): 0.25, ("dead_zone", "pressure"): 0.4,
    ("saturation", "position"): 2.5, ("saturation", "pressure"): 4.0,
    ("hysteresis", "position"): 0.2, ("hysteresis", "pressure"): 0.3,
    ("backlash", "position"): 0.2, ("backlash", "pressure"): 0.3,
    ("output_backlash", "position"): 0.15,
    ("friction", "position"): 1.5,
    ("delay", "position"): 0.04, ("delay", "pressure"): 0.04,
    ("rate_limit", "position"): 30.0, ("rate_limit", "pressure"): 20.0,
    ("leakage", "position"): 0.15, ("leakage", "pressure"): 0.06,
    ("load_dependent_gain", "position"): 12.0, ("load_dependent_gain", "pressure"): 20.0,
    ("asymmetric_gain", "position"): 0.15, ("asymmetric_gain", "pressure"): 0.15,
    ("bias", "position"): 0.15, ("bias", "pressure"): 0.2,
    ("extra_lag", "position"): 0.04, ("extra_lag", "pressure"): 0.05,
    ("resonance", "position"): 25.0, ("resonance", "pressure"): 30.0,
    ("gain_drift", "position"): 0.2, ("gain_drift", "pressure"): 0.1,
    ("periodic_disturbance", "position"): 0.3, ("periodic_disturbance", "pressure"): 0.15,
    ("cubic_stiffness", "position"): 0.2, ("cubic_stiffness", "pressure"): 0.005,
    ("overflow", "position"): 2.5, ("overflow", "pressure"): 4.5,
    ("memory", "position"): 0.2, ("memory", "pressure"): 0.15,
    ("cross_coupling", "position"): 0.25, ("cross_coupling", "pressure"): 0.08,
    ("stroke_dependent_gain", "position"): 0.3, ("stroke_dependent_gain", "pressure"): 0.1,
    ("trapped_air", "pressure"): 1.0, ("trapped_air", "position"): 1.0,
    ("frozen_sensor", "position"): 0.6, ("frozen_sensor", "pressure"): 0.6,
}  # fmt: skip


def _zoh(numerator, denominator):
    a, b, c, d = tf2ss(numerator, denominator)
    n = a.shape[0]
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n:] = a * STEP_S, b * STEP_S
    full = expm(block)
    return full[:n, :n].copy(), full[:n, n].copy(), c[0].copy(), float(d[0, 0])


@njit(cache=True)
def _play(state, u, half):
    return min(max(state, u - half), u + half)


@njit(cache=True)
def _simulate(  # noqa: PLR0917
    n,
    sub,
    ppath,
    pin,
    pc,
    vpath,
    dist_a,
    dist_b,
    dist_c,
    wp,
    wx,
    code_p,
    size_p,
    code_x,
    size_x,
    closed,
    noise,
    k_v,
    t_v,
):
    h = 1e-3
    y = np.zeros((n, 4))
    xs = np.zeros(pin.shape[0])
    xd = np.zeros(3)
    pos = 0.0
    vel = 0.0
    p = 0.0
    e_prev, u_prev, ep = 0.0, 0.0, 0.0
    uL = 0.0
    uS = 0.0
    buffers = np.zeros((2, 400))
    mem = np.zeros((2, 24))
    lugre = np.zeros(2)
    held = np.zeros(2)
    at = 0
    t = 0.0
    for k in range(n):
        # sample
        pm = 1.0 + p
        xm = pos
        for c in range(2):
            code = code_p if c == 0 else code_x
            size = size_p if c == 0 else size_x
            val = pm if c == 0 else xm
            for q in range(2):
                if code[q] == 15:
                    val += 0.0 if c == 1 else size[q] * np.sin(2 * np.pi * 1.37 * t + 0.7)
                if code[q] == 17 and c == 0:
                    s = size[q]
                    val = (
                        val
                        if val < s - 0.1
                        else (s + 0.1 if val > s + 0.3 else s - 0.1 + 0.2 * (1 - np.exp(-(val - s + 0.1) / 0.2)))
                    )
                if code[q] == 23 and c == 1:
                    mem[c, 20] = _play(mem[c, 20], val, size[q])
                    val = mem[c, 20]
            val += noise[k, c]
            for q in range(2):
                if code[q] == 22 and k > 0 and (t % 5.3) < size[q]:
                    val = held[c]
            held[c] = val
            if c == 0:
                pm = val
            else:
                xm = val
        y[k, 0] = pm
        y[k, 1] = xm
        y[k, 2] = uL
        y[k, 3] = uS
        if closed:
            e = wp[k] - pm
            nu = u_prev + 0.15 * e - 0.09 * e_prev
            nu = min(max(nu, 0.0), 10.0)
            u_prev = nu
            e_prev = e
            nxt_l = nu
            ex = wx[k] - xm
            ns = 1.2 * ex + 0.04 * (ex - ep) / 0.02
            ep = ex
            nxt_s = min(max(ns, -10.0), 10.0)
        else:
            nxt_l = wp[k]
            nxt_s = wx[k]
        uL_k = uL
        uS_k = uS
        for _ in range(sub):
            # voltages act through the chains
            drive = np.zeros(2)
            add = np.zeros(2)
            for c in range(2):
                u = uL_k if c == 0 else uS_k
                code = code_p if c == 0 else code_x
                size = size_p if c == 0 else size_x
                for q in range(2):
                    z = size[q]
                    m = mem[c]
                    base = 8 * q
                    if code[q] == 1:
                        u = u - z * np.tanh(u / z)
                    elif code[q] == 2:
                        u = u / (1 + (abs(u) / z) ** 8) ** 0.125
                    elif code[q] == 3:
                        du = u - m[base + 1]
                        m[base + 1] = u
                        pieces = 1 + int(abs(du) / z * 20)
                        for _ in range(pieces):
                            zz = m[base]
                            toward = 1.0 if du * zz > 0 else 0.0
                            m[base] = zz + du / pieces / z * (1.0 - abs(zz) ** 1.5 * toward)
                        u = u - z * m[base]
                    elif code[q] == 4:
                        m[base] = _play(m[base], u, z)
                        u = m[base]
                    elif code[q] == 6:
                        buffers[c, at % 400] = u
                        u = buffers[c, (at - round(z / h)) % 400]
                    elif code[q] == 7:
                        m[base] += min(max((u - m[base]) / 0.005, -z), z) * h
                        u = m[base]
                    elif code[q] == 9:
                        if c == 1:
                            u = u * np.sqrt(max(0.05, 1 - (p + 1.0) / z * np.tanh(u / 0.1)))
                        else:
                            u = u * np.sqrt(max(0.05, 1 - (p + 1.0) / z))
                    elif code[q] == 10:
                        ref = 0.0 if c == 1 else 3.0
                        u = ref + (u - ref) * (1 + z * np.tanh((u - ref) / 0.1))
                    elif code[q] == 11:
                        u = u + z
                    elif code[q] == 12:
                        m[base] += (u - m[base]) * (1 - np.exp(-h / z))
                        u = m[base]
                    elif code[q] == 13:
                        acc = z * z * (u - m[base]) - 2 * 0.12 * z * m[base + 1]
                        m[base + 1] += acc * h
                        m[base] += m[base + 1] * h
                        u = m[base]
                    elif code[q] == 14:
                        u = u * (1 + z * (1 - np.exp(-t / 25.0)))
                    elif code[q] == 15 and c == 1:
                        u = u + z * np.sin(2 * np.pi * 1.37 * t + 0.7)
                    elif code[q] == 18:
                        for j in range(4):
                            tau = 0.3 * 3.0**j
                            m[base + j] += (u - m[base + j]) * h / tau
                            u -= z * 0.25 * m[base + j]
                    elif code[q] == 19:
                        u = u + (z * 0.2 * uL_k * uL_k if c == 1 else z * vel)
                    elif code[q] == 20:
                        u = u * (1 + z * np.sin(pos / 2.0))
                    elif code[q] == 21:
                        m[base] += (u - m[base]) * h / (0.15 * z / (1.0 + (p * p) * 0.3 if p > 0 else 1.0))
                        u = m[base]
                drive[c] = u
            xs_new = ppath @ xs + pin * drive[0]
            # pressure leak and stiffness act on the pressure itself
            for q in range(2):
                if code_p[q] == 8:
                    add[0] += size_p[q] * p
                if code_p[q] == 16:
                    add[0] += size_p[q] * p * p * p
            if add[0] != 0.0:
                xs_new = ppath @ xs + pin * (drive[0] - add[0])
            xs = xs_new
            p = float(np.dot(pc, xs)) + 0.0
            for q in range(2):
                if code_p[q] == 13:
                    p += 0.0
            # position: T v' + v = K u - friction - ...
            force = k_v * drive[1]
            for q in range(2):
                z = size_x[q]
                if code_x[q] == 8:
                    force -= z * (p + 1.0)
                if code_x[q] == 16:
                    force -= z * pos * pos * pos
            fric = 0.0
            for q in range(2):
                if code_x[q] == 5:
                    fric = size_x[q]
            steps = 10 if fric > 0 else 1
            hh = h / steps
            for _ in range(steps):
                f = 0.0
                if fric > 0:
                    g = fric * (1.0 + 0.3 * np.exp(-((vel / 0.3) ** 2)))
                    s0 = fric / 0.01
                    # implicit in the bristle
                    lugre[0] = (lugre[0] + hh * vel) / (1 + hh * abs(vel) * s0 / g)
                    f = s0 * lugre[0] + 0.05 * vel
                vel = (vel + hh / t_v * (force - f)) / (1 + hh / t_v)
                pos += hh * vel
            for q in range(2):
                if code_x[q] == 17 and pos > size_x[q]:
                    pos = size_x[q]
                    vel = min(vel, 0.0)
            pd_old = float(np.dot(dist_c, xd))
            xd = dist_a @ xd + dist_b * p
            pos += float(np.dot(dist_c, xd)) - pd_old
            at += 1
            t += h
        uL = nxt_l
        uS = nxt_s
    return y


def _wave(shape, n, frequency, low, high, seed):
    t = SAMPLE_S * np.arange(n)
    phase = (t * frequency) % 1.0
    if shape == "square":
        unit = (phase < 0.5).astype(float)
    elif shape == "sine":
        unit = 0.5 + 0.5 * np.sin(2 * np.pi * phase)
    elif shape == "triangle":
        unit = 1 - np.abs(2 * phase - 1)
    else:
        rng = np.random.default_rng(seed + 999)
        hold = rng.integers(15, 80, size=n)
        unit = np.repeat(rng.random(n), hold)[:n]
    return low + (high - low) * unit


def make(case: Case) -> Run:
    """The run table of a case (SI)."""
    rng = np.random.default_rng(case.seed)
    n = round(case.seconds / SAMPLE_S)
    g, s = 1 + case.gain_error, 1 + case.time_error
    num = np.array([295.1, -2.944e4, 7.457e6, -1.267e8, 3.217e10])
    den = np.array([1, 159.3, 1.962e4, 1.479e6, 7.247e7, 2.244e9, 3.242e10])
    num = g * num * s ** np.arange(4, -1, -1)
    den = den * s ** np.arange(6, -1, -1)
    a, b, c, _ = _zoh(num, den)
    da, db, dc, _ = _zoh([64.72, -16.45], [1, 76.54, 2009, 0])
    if case.closed:
        wp = _wave(case.shape, n, 0.25, 1.0, 5.0, case.seed)
        wx = _wave(case.shape, n, 0.17, -3.0, 3.0, case.seed + 1)
    else:
        wp = _wave(case.shape, n, 0.25, 0.0, 5.0, case.seed)
        wx = _wave(case.shape, n, 0.31, -2.0, 2.0, case.seed + 1)
    code = {"pressure": np.zeros(2, np.int64), "position": np.zeros(2, np.int64)}
    size = {"pressure": np.ones(2), "position": np.ones(2)}
    for name, channel, scale in case.effects:
        slot = int(code[channel][0] != 0)
        code[channel][slot] = CODE[name]
        size[channel][slot] = DEFAULTS[name, channel] * scale
    if case.noise_db > 200:
        noise = np.zeros((n, 2))
    else:
        level = 10 ** (-case.noise_db / 20)
        noise = rng.standard_normal((n, 2)) * level * np.array([1.6, 2.4])
    k_v, t_v = 206.4 / 23.34 * g, s / 23.34
    y = _simulate(
        n, 20, a, b, c, 0.0, da, db, dc, wp, wx, code["pressure"], size["pressure"], code["position"], size["position"],
        case.closed, noise, k_v, t_v,
    )  # fmt: skip
    signals = {
        "pressure_setpoint_pa": wp * 1e6 if case.closed else np.zeros(n),
        "position_setpoint_m": wx * 0.01 if case.closed else np.zeros(n),
        "load_voltage_v": y[:, 2],
        "servo_voltage_v": y[:, 3],
        "pressure_pa": y[:, 0] * 1e6,
        "position_m": y[:, 1] * 0.01,
    }
    return Run(SAMPLE_S, signals, 0.0, "case")
