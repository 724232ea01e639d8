"""The one error of the preparation that people are meant to see."""


class PreparationError(Exception):
    """One sentence that says what is missing or failed, and what to do."""
