"""Bags and tables to arrays and back."""

from .bag import Bag, RecordedMessage
from .bagrun import run_from_bag
from .datamap import DataMap, load_map
from .errors import RecordError
from .load import load_run
from .mcapfile import TornError
from .tables import write_csv

__all__ = [
    "Bag",
    "DataMap",
    "RecordError",
    "RecordedMessage",
    "TornError",
    "load_map",
    "load_run",
    "run_from_bag",
    "write_csv",
]
