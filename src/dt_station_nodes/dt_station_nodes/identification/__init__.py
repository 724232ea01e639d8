"""Model estimation from runs, and controller tuning: pure functions of arrays."""

from .errors import IdentificationError
from .estimate import Estimate, Interval, fit_percent
from .fitting import estimate
from .selection import Candidate, Selection, choose, orders, select
from .station import IdentifiedPath, Method, identify_closed_loop, identify_direct, identify_disturbance
from .structure import Data, Hold, PathStructure, Structure
from .transfer import TransferFunction

__all__ = [
    "Candidate",
    "Data",
    "Estimate",
    "Hold",
    "IdentificationError",
    "IdentifiedPath",
    "Interval",
    "Method",
    "PathStructure",
    "Selection",
    "Structure",
    "TransferFunction",
    "choose",
    "estimate",
    "fit_percent",
    "identify_closed_loop",
    "identify_direct",
    "identify_disturbance",
    "orders",
    "select",
]
