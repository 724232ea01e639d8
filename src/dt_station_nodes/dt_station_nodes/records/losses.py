"""What became of the messages that are not in a bag, as it says itself."""

from collections.abc import Sequence
from dataclasses import dataclass

from .errors import RecordError

LOSS = "dt_station_loss"


@dataclass(slots=True)
class TopicLoss:
    """What became of a topic's messages: written, skipped numbers, dropped by the queue, refused by the disk."""

    received: int = 0
    lost: int = 0
    dropped: int = 0
    unwritten: int = 0

    @property
    def missing(self) -> int:
        """Messages that are not in the bag."""
        return self.lost + self.dropped + self.unwritten


def loss_text(names: Sequence[str], losses: Sequence[TopicLoss], prefix: str = "") -> dict[str, str]:
    """One line a topic."""
    return {
        f"{prefix}{name}": f"received={loss.received} lost={loss.lost} dropped={loss.dropped} "
        f"unwritten={loss.unwritten}"
        for name, loss in zip(names, losses, strict=True)
    }


def parse_loss(text: str) -> TopicLoss:
    """The counts of one topic from a bag's loss record."""
    try:
        values = dict(part.split("=", 1) for part in text.split())
        return TopicLoss(*(int(values[name]) for name in ("received", "lost", "dropped", "unwritten")))
    except (KeyError, ValueError):
        raise RecordError(f"the bag's loss record is damaged ({text!r})") from None
