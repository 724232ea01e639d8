"""Bags and tables to arrays and back."""

from .datamap import DataMap, load_map
from .errors import RecordError
from .load import load_run
from .tables import write_csv

__all__ = ["DataMap", "RecordError", "load_map", "load_run", "write_csv"]
