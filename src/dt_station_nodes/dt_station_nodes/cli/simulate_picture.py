"""The picture `dt-station simulate` leaves."""

from pathlib import Path

from matplotlib.figure import Figure

from ..core.channels import Channel
from ..core.run import Run


def draw(simulated: Run, measured: Run | None, path: Path) -> None:
    """Outputs with set-points and measured values, and the voltages below."""
    channels = [c for c in Channel if c.signal in simulated.signals]
    figure = Figure(figsize=(9.0, 2.6 * (len(channels) + 1)), layout="constrained")
    axes = figure.subplots(len(channels) + 1, 1, sharex=True)
    for axis, channel in zip(axes, channels, strict=False):
        if measured is not None and channel.signal in measured.signals:
            axis.plot(measured.time_s, measured.signals[channel.signal], color="0.55", label="measured", linewidth=0.9)
        if channel.setpoint_signal in simulated.signals:
            axis.plot(simulated.time_s, simulated.signals[channel.setpoint_signal], "k--", label="set-point")
        axis.plot(simulated.time_s, simulated.signals[channel.signal], label="model")
        axis.set_ylabel(f"{channel.signal}, {simulated.unit(channel.signal)}")
        axis.legend(loc="best", fontsize="small")
    for channel in channels:
        axes[-1].step(
            simulated.time_s, simulated.signals[channel.voltage_signal], where="post", label=channel.voltage_signal
        )
    axes[-1].set_ylabel("V")
    axes[-1].set_xlabel("time, s")
    axes[-1].legend(loc="best", fontsize="small")
    figure.savefig(path, dpi=110)
