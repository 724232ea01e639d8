"""What a user may turn about discovery; every default was set on synthetic calibration runs."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DiscoverySettings:
    """Frozen settings of one discovery.

    `window_s`: length of the re-anchored windows of integrating paths, s.
    `max_effects`: most effects looked for per channel.
    `jobs`: worker processes; the answer does not depend on it.
    `free_linear`: refit all coefficients of the linear part with every candidate (None: only where the
    given one is far off, as with a linear model that was fitted to nonlinear data).
    `budget_s`: after this many seconds no further stage is begun (0: no limit).
    """

    window_s: float = 3.0
    max_effects: int = 3
    jobs: int = 1
    free_linear: bool | None = None
    budget_s: float = 0.0
