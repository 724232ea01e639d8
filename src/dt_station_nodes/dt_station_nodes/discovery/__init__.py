"""Discovery: finds, names and adds the effect that a model lacks."""

from .data_checks import UnusableRunError
from .engine import discover
from .result import DiscoveryResult, NextExperiment, Verdict
from .settings import DiscoverySettings

__all__ = ["DiscoveryResult", "DiscoverySettings", "NextExperiment", "UnusableRunError", "Verdict", "discover"]
