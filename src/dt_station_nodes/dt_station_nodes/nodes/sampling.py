"""The bridge's loop: metronome, object and counters, without ROS. The clock is passed in."""

import math
import time
from collections.abc import Callable, Mapping

from ..core.channels import Channel
from ..core.metronome import Metronome, Pace
from ..core.samples import PlantSample, SampleFlag, ValveCommand
from ..hardware import Backend
from .bridge_statistics import BridgeStatistics

Clock = Callable[[], int]


class Sampling:
    """Takes samples of an open backend, hands them to `publish`, writes the commands that answer them.

    `last` is the number of the last sample (None: none is), `delay` the samples between a command's arrival and
    its action (0 or 1), `clock` a steady one in ns. `on_end` is called once, after the last sample.
    """

    def __init__(
        self,
        metronome: Metronome,
        backend: Backend,
        publish: Callable[[PlantSample], None],
        on_end: Callable[[], None],
        last: int | None = None,
        delay: int = 0,
        clock: Clock = time.perf_counter_ns,
    ) -> None:
        self._metronome, self._backend, self._publish, self._on_end = metronome, backend, publish, on_end
        self._last, self._delay, self._clock = last, delay, clock
        self._state = metronome.start(0)
        self._stamp_ns = 0
        self._applied, self._flags = (0.0, 0.0), SampleFlag.OK
        self._pending: Mapping[Channel, float] = {}
        # in lockstep with nobody to wait for, the next sample is due at once
        self._eager = False
        self._held_ns: int | None = None
        self._held_from: int | None = None
        self.running = self.ended = False
        self.statistics = BridgeStatistics(metronome.pace, metronome.offset_ns(1) * 1e-9)

    def start(self, stamp_ns: int, following: bool) -> None:
        """Sample 0 is due now and has this stamp; `following` says that followers will report."""
        now = self._clock()
        self._state = self._metronome.start(now, following)
        self._stamp_ns = stamp_ns
        self.running = True
        self.statistics.start(now)

    def stop(self) -> None:
        """Take no more samples and bring the object to rest; safe to call twice."""
        self.running = False
        self._backend.close()

    def hold(self, held: bool, held_from: int | None = None) -> None:
        """Take no more samples, or none from number `held_from` on, until told to go on.

        For lockstep, whose object stands still meanwhile. A command that answers the last sample still acts.
        """
        self._held_from = held_from
        held = held or self._held_next()
        if held == (self._held_ns is not None):
            return
        now = self._clock()
        if self._held_ns is None:
            self._held_ns = now
            return
        self._state = self._metronome.resume(self._state, now - self._held_ns)
        self._held_ns = None
        self.tick()

    def _held_next(self) -> bool:
        return self._held_from is not None and self._state.sequence + 1 >= self._held_from

    def deadline_ns(self) -> int | None:
        """When the next sample is due or a silent controller is given up (0: at once); None while none is."""
        if not self.running or self._held_ns is not None:
            return None
        return 0 if self._eager else self._state.due_ns

    def tick(self) -> None:
        """Take the next sample if it is due, whatever has come in."""
        if not self.running or self._held_ns is not None:
            return
        now = self._clock()
        if not self._state.answered and now >= self._state.due_ns:
            self._state = self._metronome.overslept(self._state, now)
            if now < self._state.due_ns:
                return
            # in lockstep there may still be followers to wait for
            self._answer()
        if self._metronome.due(self._state, now):
            self._take()

    def on_command(self, channel: Channel, command: ValveCommand) -> None:
        """A command came in. One that is no number is none at all."""
        if not math.isfinite(command.voltage_v):
            return
        self._state = self._metronome.accept(self._state, channel, command)
        if self.running and not self._state.answered and self._metronome.complete(self._state):
            self._answer()
            self.tick()

    def on_follower(self, sequence: int) -> None:
        """A follower has dealt with sample `sequence`."""
        self._state = self._metronome.follow(self._state, sequence)
        self.tick()

    def on_reader(self) -> None:
        """Somebody new listens to the samples."""
        self._state = self._metronome.welcome(self._state)
        self.tick()

    def _take(self) -> None:
        if not self._state.answered:
            self._answer()
        now = self._clock()
        self._state, tick = self._metronome.take(self._state, now)
        flags = self._flags
        if tick.overrun(self._metronome.offset_ns(1)):
            flags |= SampleFlag.OVERRUN
        reading = self._backend.read()
        ended = reading.ended or tick.sequence == self._last
        sample = PlantSample(
            tick.sequence,
            self._stamp_ns + self._metronome.offset_ns(tick.sequence),
            reading.position_m,
            reading.pressure_pa,
            *self._applied,
            flags | reading.flags | (SampleFlag.END if ended else SampleFlag.OK),
        )
        self._publish(sample)
        self.statistics.sampled(tick, now, sample.flags)
        if ended:
            self.ended = True
            self.statistics.end(self._clock())
            self.stop()
            self._on_end()
            return
        if self._delay:
            self._write(self._pending)
        if self._metronome.complete(self._state):
            self._answer()
        if self._held_next():
            self.hold(True, self._held_from)
        self._eager = self._metronome.due(self._state, now)

    def _answer(self) -> None:
        excused = self._state.excused
        self._state, answer = self._metronome.answer(self._state)
        now = self._clock()
        if self._state.sequence == 0 and self._metronome.pace is Pace.REALTIME:
            self._state = self._metronome.begin(self._state, now)
            self.statistics.start(now - self._metronome.offset_ns(1))
        else:
            self.statistics.answered(answer, now, excused)
        self._flags = answer.flags
        if self._delay:
            self._pending = answer.voltage_v
        else:
            self._write(answer.voltage_v)

    def _write(self, voltage_v: Mapping[Channel, float]) -> None:
        applied = self._backend.write(voltage_v.get(Channel.PRESSURE, 0.0), voltage_v.get(Channel.POSITION, 0.0))
        self._applied = (applied.load_voltage_v, applied.servo_voltage_v)
        self._flags |= applied.flags
