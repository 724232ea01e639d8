"""The ranked candidates of all channels, as the report shows them."""

from collections.abc import Sequence

import numpy as np

from .candidates import in_vocabulary
from .channel import Finding
from .result import RankedCandidate

MOST = 14


def ranking_of(findings: Sequence[Finding]) -> tuple[RankedCandidate, ...]:
    """The best of each channel, and the nominal parameters alone."""
    rows = []
    for finding in findings:
        floor = finding.sigma**2
        null = next((e for e in finding.ranking if not e.added), finding.null)
        start = float(np.mean(null.fit.residual**2)) - floor
        ranked = list(zip(finding.ranking, finding.scores, strict=True))
        for explanation, score in ranked[:MOST] + [row for row in ranked[MOST:] if not row[0].added]:
            power = float(np.mean(explanation.fit.residual**2))
            explained = 1.0 - max(power - floor, 0.0) / start if start > 0.0 else 0.0
            rows.append(
                RankedCandidate(
                    finding.problem.channel,
                    explanation.added,
                    power**0.5,
                    float(np.clip(explained, 0.0, 1.0)),
                    score,
                    all(in_vocabulary(name) for name in explanation.added),
                )
            )
    return tuple(rows)
