"""Work shared between processes."""

from .pool import ALONE, Workers

__all__ = ["ALONE", "Workers"]
