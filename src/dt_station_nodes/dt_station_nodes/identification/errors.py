"""What a user can get wrong in an identification."""

from ..core.errors import StationError


class IdentificationError(StationError):
    """The run or the request cannot be identified; its text says what to do about it."""
