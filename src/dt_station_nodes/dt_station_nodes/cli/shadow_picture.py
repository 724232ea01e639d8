"""One picture a channel: measured and simulated above, their difference below."""

from pathlib import Path
from typing import TYPE_CHECKING

from ..core.channels import Channel

if TYPE_CHECKING:
    from ..records.comparing import Gap


def draw_channel(channel: Channel, gap: "Gap", unit: str, model: str, path: Path) -> Path:
    """Write the picture as PNG and return its path; `unit` is shown as given, "1" as none."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    label = channel.value if unit == "1" else f"{channel.value}, {unit}"
    figure = Figure(figsize=(10, 6), layout="constrained")
    FigureCanvasAgg(figure)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    above.plot(gap.time_s, gap.first, color="0.3", linewidth=1.2, label="measured")
    above.plot(gap.time_s, gap.second, color="tab:blue", linewidth=1.0, label=f"twin: {model}")
    above.set_title(f"fit {gap.fit_percent:.1f} %, RMS {gap.rms:.4g}")
    above.set_ylabel(label)
    above.legend(loc="upper right")
    below.plot(gap.time_s, gap.first - gap.second, color="tab:red", linewidth=0.8)
    below.axhline(0.0, color="0.5", linewidth=0.6)
    below.set_ylabel(f"gap{'' if unit == '1' else f', {unit}'}")
    below.set_xlabel("time, s")
    figure.savefig(path, dpi=110)
    return path
