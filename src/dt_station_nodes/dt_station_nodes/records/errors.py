"""What goes wrong with files of records."""

from ..core.errors import StationError


class RecordError(StationError):
    """A file of records cannot be used; the text names the file and what is wrong with it."""
