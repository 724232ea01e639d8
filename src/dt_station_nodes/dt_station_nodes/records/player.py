"""Plays messages in order: when the next is due, and whether the followers have answered the last sample."""

from collections.abc import Callable, Iterator, Sequence

from .pacing import Pace
from .playlist import PlayedMessage

Publish = Callable[[PlayedMessage], None]


class Player:
    """Hands messages to `publish` as they fall due; all times are ns of one steady clock given by the caller.

    A sample is held back until every follower has answered the one before it, at most `timeout_ns`. `source` begins
    the playlist anew, for `loop`.
    """

    def __init__(
        self,
        source: Callable[[], Iterator[PlayedMessage]],
        publish: Publish,
        pace: Pace,
        followers: Sequence[str] = (),
        timeout_ns: int = 2_000_000_000,
        loop: bool = False,
    ) -> None:
        self._source, self._publish, self._loop = source, publish, loop
        self._timeout_ns = timeout_ns
        self._answered = dict.fromkeys(followers, -1)
        self._messages: Iterator[PlayedMessage] = iter(())
        self._next: PlayedMessage | None = None
        self._awaited = -1
        self._given_up_ns = 0
        self._steps = 0
        self.pace = pace
        self.started = self.ended = False
        self.played = self.unanswered = self.last_due_ns = 0

    def start(self, now_ns: int) -> None:
        """Play from the first message on."""
        self.started = True
        self._begin(now_ns)
        self.ended = self._next is None

    def change(self, rate: float, paused: bool, now_ns: int) -> None:
        """Another speed or state from now on."""
        self.pace = self.pace.changed(rate, paused, now_ns, self.last_due_ns)

    def step(self) -> bool:
        """Play up to the next sample; False unless paused."""
        if not self.pace.paused or self.ended:
            return False
        self._steps += 1
        return True

    def heard(self, follower: str, sequence: int) -> None:
        """A follower has answered a sample."""
        self._answered[follower] = max(self._answered[follower], sequence)

    def deadline_ns(self) -> int | None:
        """When `tick` is next wanted; None: not before something is heard or changed."""
        if not self.started or self._next is None:
            return None
        if self._held():
            return self._given_up_ns
        if self._steps:
            return 0
        return None if self.pace.paused else self.pace.wall_of(self._next.due_ns)

    def tick(self, now_ns: int) -> None:
        """Play what is due."""
        if not self.started:
            return
        if self._held() and now_ns >= self._given_up_ns:
            self.unanswered += 1
            self._answered = dict.fromkeys(self._answered, self._awaited)
        while self._next is not None and not self._held():
            message = self._next
            if self._steps:
                self._steps -= message.is_state
            elif self.pace.paused or self.pace.wall_of(message.due_ns) > now_ns:
                return
            self._play(message, now_ns)
            if self.pace.paused and message.is_state and not self._steps:
                return

    def _play(self, message: PlayedMessage, now_ns: int) -> None:
        self._publish(message)
        self.last_due_ns = message.due_ns
        self.played += 1
        if message.is_state and self._answered:
            self._awaited = message.sequence
            self._answered = dict.fromkeys(self._answered, -1)
            self._given_up_ns = now_ns + self._timeout_ns
        self._next = next(self._messages, None)
        if self._next is None and self._loop:
            self._begin(now_ns)
        self.ended = self._next is None

    def _begin(self, now_ns: int) -> None:
        self._messages = self._source()
        self._next = next(self._messages, None)
        if self._next is not None:
            self.pace = self.pace.anchored(now_ns, self._next.due_ns)

    def _held(self) -> bool:
        """Whether the next sample has to wait for an answer to the last one; what is not a sample need not."""
        if self._next is None or not self._next.is_state:
            return False
        return any(number < self._awaited for number in self._answered.values())
