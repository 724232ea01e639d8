"""What the bridge counts: missed samples, overruns, latency, rate."""

from typing import Any

from ..core.latency import LatencyHistogram
from ..core.metronome import Answer, Pace, Tick
from ..core.samples import SampleFlag
from .diagnostics import Health, Level


class BridgeStatistics:
    """Accumulates over one run; times are nanoseconds of a steady clock."""

    def __init__(self, pace: Pace, sample_time_s: float) -> None:
        self._pace = pace
        self._sample_time_s = sample_time_s
        self._latency = LatencyHistogram()
        self._taken_ns = self._started_ns = self._last_ns = 0
        self.samples = self.missed = self.overruns = self.excused = 0
        self._missed: dict[str, int] = {}
        self._late_max_ns = self._shifted_ns = self._followers_lost = self._sensor_faults = self._limited = 0

    def start(self, now_ns: int) -> None:
        """The run begins."""
        self._started_ns = self._last_ns = now_ns

    def end(self, now_ns: int) -> None:
        """The run is over."""
        self._last_ns = now_ns

    def sampled(self, tick: Tick, now_ns: int, flags: SampleFlag) -> None:
        """A sample was taken."""
        self._taken_ns = self._last_ns = now_ns
        self.samples += 1
        self.overruns += SampleFlag.OVERRUN in flags
        self._sensor_faults += SampleFlag.SENSOR_FAULT in flags
        self._limited += bool(flags & (SampleFlag.LOAD_VOLTAGE_LIMITED | SampleFlag.SERVO_VOLTAGE_LIMITED))
        self._late_max_ns = max(self._late_max_ns, tick.late_ns)
        self._shifted_ns += tick.shifted_ns
        self._followers_lost += tick.follower_lost

    def answered(self, answer: Answer, now_ns: int, excused: bool = False) -> None:
        """The sample's commands are in, or given up; `excused`: after a standstill that was not theirs."""
        self.excused += excused and not answer.missed
        if answer.missed:
            self.missed += 1
            for channel in answer.missed:
                self._missed[channel.value] = self._missed.get(channel.value, 0) + 1
        else:
            self._latency.add((now_ns - self._taken_ns) * 1e-9)

    def values(self) -> dict[str, Any]:
        """All figures by name, SI."""
        wall_s = max(1e-9, (self._last_ns - self._started_ns) * 1e-9)
        return {
            "pace": self._pace.value,
            "sample_time_s": self._sample_time_s,
            "samples": self.samples,
            "missed_samples": self.missed,
            "missed_pressure": self._missed.get("pressure", 0),
            "missed_position": self._missed.get("position", 0),
            "excused_samples": self.excused,
            "overruns": self.overruns,
            "latency_p50_s": self._latency.percentile(0.5),
            "latency_p99_s": self._latency.percentile(0.99),
            "latency_max_s": self._latency.maximum_s,
            "late_max_s": self._late_max_ns * 1e-9,
            "stood_still_s": self._shifted_ns * 1e-9,
            "followers_lost": self._followers_lost,
            "sensor_faults": self._sensor_faults,
            "limited_samples": self._limited,
            "wall_s": wall_s,
            "realtime_factor": max(0, self.samples - 1) * self._sample_time_s / wall_s,
        }

    def health(self, running: bool, ended: bool) -> Health:
        """For /diagnostics."""
        values = {"phase": "ended" if ended else "running" if running else "waiting", **self.values()}
        if self._followers_lost or self._shifted_ns:
            return Health(Level.ERROR, "the graph did not keep up", values)
        if self.missed:
            return Health(Level.WARN, f"{self.missed} samples without a command in time", values)
        if not running and not ended:
            return Health(Level.OK, "waiting for the graph to connect", values)
        return Health(Level.OK, "run ended" if ended else "sampling", values)
