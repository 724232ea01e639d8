"""When a replayed message is due on the wall clock: rate, pause, single steps."""

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Pace:
    """At wall time `wall_ns` the replay stood at `due_ns`; `rate` 0 is as fast as possible."""

    rate: float
    paused: bool = False
    wall_ns: int = 0
    due_ns: int = 0

    def anchored(self, wall_ns: int, due_ns: int) -> "Pace":
        """The replay stands at `due_ns` now."""
        return replace(self, wall_ns=wall_ns, due_ns=due_ns)

    def wall_of(self, due_ns: int) -> int:
        """Wall time (ns) at which a message is played; only while not paused."""
        if self.rate <= 0.0:
            return self.wall_ns
        return self.wall_ns + round((due_ns - self.due_ns) / self.rate)

    def changed(self, rate: float, paused: bool, wall_ns: int, last_due_ns: int) -> "Pace":
        """Another rate or state from now on, going on from where the replay stands."""
        elapsed_ns = 0 if self.paused else round((wall_ns - self.wall_ns) * self.rate)
        stands = max(last_due_ns, self.due_ns + elapsed_ns)
        return Pace(rate, paused, wall_ns, stands)
