"""Noisy runs of known systems, made by scipy's simulation and not by ours."""

import numpy as np
from scipy.signal import lsim

from dt_station_nodes.identification import Data, TransferFunction

SAMPLE_TIME_S = 0.02
PRESSURE = TransferFunction(
    (295.1, -2.944e4, 7.457e6, -1.267e8, 3.217e10),
    (1.0, 159.3, 1.962e4, 1.479e6, 7.247e7, 2.244e9, 3.242e10),
)
POSITION = TransferFunction((206.4,), (1.0, 23.34, 0.0))
DISTURBANCE = TransferFunction((64.72, -16.45), (1.0, 76.54, 2009.0, 0.0))


def switching(samples, dwell, low, high, seed):
    """A random two-level signal that may change every `dwell` samples."""
    bits = np.random.default_rng(seed).integers(0, 2, samples // dwell + 1)
    return (low + (high - low) * bits).repeat(dwell)[:samples]


def response(transfer, signal, smooth=False, sample_time_s=SAMPLE_TIME_S):
    """Output at the samples of a signal held, or straight between them."""
    time_s = sample_time_s * np.arange(signal.size)
    return lsim((transfer.numerator, transfer.denominator), signal, time_s, interp=smooth)[1]


def noisy(clean, seed, share=0.01):
    """The signal with white noise of a share of its spread (0.01: 40 dB)."""
    return clean + share * clean.std() * np.random.default_rng(seed).normal(size=clean.size)


def pressure_data(samples=3000, seed=0):
    voltage = switching(samples, 3, 0.0, 5.0, 1000 + seed)
    return Data(SAMPLE_TIME_S, (voltage,), 1.0 + noisy(response(PRESSURE, voltage), seed), ("load_voltage_v",))


def disturbance_data(samples=3000, seed=0):
    pressure = response(PRESSURE, switching(samples, 10, 0.0, 5.0, 3000 + seed))
    return Data(SAMPLE_TIME_S, (pressure,), noisy(response(DISTURBANCE, pressure, smooth=True), seed), ("pressure_pa",))
