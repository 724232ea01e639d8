"""What a run leaves in figures."""

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class RunStatistics:
    """The bridge's and the shadow's figures (SI), every node's exit status and restarts, their last words."""

    scenario: str
    composed: bool
    bridge: dict[str, Any]
    shadow: dict[str, Any]
    exit_status: dict[str, int]
    restarts: dict[str, int]
    health: dict[str, Any] = field(default_factory=dict)
