"""The root of every mistake that a user can make and mend."""


class StationError(ValueError):
    """An expected mistake; its text is one sentence that says what to do."""
