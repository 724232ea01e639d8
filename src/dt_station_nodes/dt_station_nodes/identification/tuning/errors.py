"""What a user can get wrong in a tuning."""

from ...core.errors import StationError


class TuningError(StationError):
    """A loop that cannot be tuned or judged; its text says what to do about it."""
