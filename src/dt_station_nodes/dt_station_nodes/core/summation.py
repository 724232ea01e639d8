"""Sums that stay exact enough over a day of samples."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CompensatedSum:
    """Neumaier's compensated sum (Z. Angew. Math. Mech. 54, 1974): error of one rounding, however many terms."""

    total: float = 0.0
    carry: float = 0.0

    def add(self, term: float) -> "CompensatedSum":
        """The sum with one more term."""
        total = self.total + term
        if abs(self.total) >= abs(term):
            carry = self.carry + ((self.total - total) + term)
        else:
            carry = self.carry + ((term - total) + self.total)
        return CompensatedSum(total, carry)

    @property
    def value(self) -> float:
        """The sum."""
        return self.total + self.carry


# a cell is (term, sum of this cell and all below it, cell below)
_Cell = tuple[float, float, "object"]


@dataclass(frozen=True, slots=True)
class WindowSum:
    """Sum of the last `length` terms from additions only: two stacks, so nothing is ever subtracted."""

    length: int
    count: int = 0
    front: _Cell | None = None
    back: _Cell | None = None
    back_count: int = 0

    def add(self, term: float) -> "WindowSum":
        """The window moved on by one term."""
        front, back, back_count, count = self.front, self.back, self.back_count, self.count
        if count == self.length:
            if front is None:
                while back is not None:
                    front = (back[0], back[0] + (front[1] if front else 0.0), front)
                    back = back[2]  # type: ignore[assignment]
                back_count = 0
            front = front[2]  # type: ignore[index,assignment]
            count -= 1
        back = (term, term + (back[1] if back else 0.0), back)
        return WindowSum(self.length, count + 1, front, back, back_count + 1)

    @property
    def value(self) -> float:
        """Sum over the window."""
        return (self.front[1] if self.front else 0.0) + (self.back[1] if self.back else 0.0)
