"""The paper's experiments repeated, and its figures beside ours."""

from .bench import CONTROLLERS, Bench
from .compare import rows
from .loops import Hold, PressureResponse, hold, pressure_response
from .paths import Disturbance, ServoPath, StaticPressure
from .results import STEPS, ObjectResults, Results, run_all
from .row import Row, Status

__all__ = [
    "CONTROLLERS",
    "STEPS",
    "Bench",
    "Disturbance",
    "Hold",
    "ObjectResults",
    "PressureResponse",
    "Results",
    "Row",
    "ServoPath",
    "StaticPressure",
    "Status",
    "hold",
    "pressure_response",
    "rows",
    "run_all",
]
