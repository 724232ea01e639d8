"""What a user may turn about discovery; every default was set on synthetic calibration runs."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DiscoverySettings:
    """Frozen settings of one discovery.

    `window_s`: length of the re-anchored windows of integrating paths, s (0: by the data, at most 3 s and no more
    than 150 samples, so that with fast sampling force errors count and not the drift they leave).
    `max_effects`: most effects looked for per channel.
    `rough`: a linear path that may be refitted as a whole is, and its noise taken to be out of any model's reach.
    `jobs`: worker processes; the answer does not depend on it.
    """

    window_s: float = 0.0
    max_effects: int = 3
    rough: bool = False
    jobs: int = 1
