"""Pictures of an identification; the only module here that imports matplotlib."""

import numpy as np
from matplotlib.figure import Figure

from ..core.run import Array, Run
from .noise import autocorrelation
from .static_characteristic import StaticCharacteristic
from .station import IdentifiedPath, Method


def fit_figure(path: IdentifiedPath) -> Figure:
    """Measured and simulated output, whole and closer, the residual, and its autocorrelation."""
    data = path.data
    figure = _figure(9.0, 9.0)
    above, close, middle, below = figure.subplots(4, 1, height_ratios=[2, 2, 1.5, 1.5])
    time_s = data.sample_time_s * np.arange(len(data))
    start = len(data) // 3
    for axes, rows in ((above, slice(None)), (close, slice(start, start + max(len(data) // 12, 10)))):
        axes.plot(time_s[rows], data.output[rows], label="measured", color="0.3", linewidth=0.9)
        label = f"model, fit {path.estimate.fit_percent:.2f} %"
        axes.plot(time_s[rows], path.estimate.output[rows], label=label, linestyle="--", linewidth=1.2)
        axes.set_ylabel(f"{data.output_name or path.channel.signal} / {path.scale:g}")
    above.legend(loc="upper right")
    middle.plot(time_s, path.estimate.residual, linewidth=0.7)
    middle.set_ylabel("residual")
    middle.set_xlabel("time, s")
    lags = min(50, len(data) // 4)
    covariance = autocorrelation(path.estimate.residual, lags)
    below.stem(np.arange(1, lags + 1), covariance[1:] / max(covariance[0], np.finfo(float).tiny), markerfmt=".")
    band = 2.58 / np.sqrt(len(data))
    below.axhspan(-band, band, alpha=0.2)
    below.set_ylabel("autocorrelation")
    below.set_xlabel("lag, samples")
    return figure


def bode_figure(path: IdentifiedPath) -> Figure:
    """Bode diagrams up to the Nyquist frequency with 95 % bands of the gain, and poles and zeros."""
    transfers = {path.channel.value if path.method is not Method.DISTURBANCE else "disturbance": path.transfer}
    if path.method is Method.DIRECT and path.disturbance is not None:
        transfers["disturbance"] = path.disturbance
    sample_time_s = path.data.sample_time_s
    figure = _figure(9.0, 7.5)
    layout = figure.subplot_mosaic([["gain", "poles"], ["phase", "poles"]], width_ratios=[1.2, 1.0])
    nyquist = np.pi / sample_time_s
    frequency: Array = np.geomspace(nyquist / 1000.0, nyquist, 400)
    for index, (name, transfer) in enumerate(transfers.items()):
        response = transfer.frequency_response(frequency)
        (line,) = layout["gain"].loglog(frequency, np.abs(response), label=name)
        colour = line.get_color()
        if path.method is not Method.CLOSED_LOOP:
            half = path.estimate.gain_band(frequency, index)
            low = np.maximum(np.abs(response) - half, 1e-3 * np.abs(response))
            layout["gain"].fill_between(frequency, low, np.abs(response) + half, color=colour, alpha=0.25)
        layout["phase"].semilogx(frequency, np.degrees(np.unwrap(np.angle(response))), color=colour)
        poles, zeros = transfer.poles(), transfer.zeros()
        layout["poles"].plot(poles.real, poles.imag, "x", color=colour, label=f"{name} poles")
        layout["poles"].plot(zeros.real, zeros.imag, "o", color=colour, fillstyle="none", label=f"{name} zeros")
    layout["gain"].set_ylabel("gain")
    layout["gain"].legend(loc="best")
    layout["phase"].set_ylabel("phase, degrees")
    layout["phase"].set_xlabel("frequency, rad/s")
    layout["poles"].axvline(0.0, color="0.7", linewidth=0.8)
    layout["poles"].axhline(0.0, color="0.7", linewidth=0.8)
    layout["poles"].set_xlabel("real part, rad/s")
    layout["poles"].set_ylabel("imaginary part, rad/s")
    layout["poles"].legend(loc="best", fontsize="small")
    return figure


def characteristic_figure(shape: StaticCharacteristic, run: Run) -> Figure:
    """Both branches of a static characteristic."""
    figure = _figure(7.0, 5.0)
    axes = figure.subplots()
    axes.plot(shape.rising.voltage_v, shape.rising.output, ".-", label="voltage rising")
    axes.plot(shape.falling.voltage_v, shape.falling.output, ".-", label="voltage falling")
    unit = run.unit(shape.channel.signal)
    axes.set_xlabel(f"{shape.channel.voltage_signal}, V")
    axes.set_ylabel(f"{shape.channel.signal}, {shape.scale:g} {unit}{'/s' if shape.integrating else ''}")
    axes.legend(loc="best")
    axes.grid(alpha=0.3)
    return figure


def _figure(width: float, height: float) -> Figure:
    return Figure(figsize=(width, height), layout="constrained")
