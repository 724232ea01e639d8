"""The explanations that the next experiment should tell from the one found."""

from .channel import Finding
from .namesakes import namesakes
from .result import Verdict
from .selection import Explanation
from .verdict import better_without

AS_LITTLE = 2.0  # times the sum of squares: sets that leave more are no rivals


def contenders(finding: Finding, overall: Verdict) -> list[Explanation]:
    """Explanations that could stand where the best one does, the likeliest first; none where it stands alone.

    `overall` is the verdict over all channels: where effects are named, what else parameters could be is left open.
    """
    match finding.verdict:
        case Verdict.NAMED:
            return _same_size(finding) if any(finding.alternatives) else better_without(finding)[:1]
        case Verdict.PARAMETERS_ONLY if overall is Verdict.PARAMETERS_ONLY:
            return _instead(finding)
        case Verdict.UNEXPLAINED if finding.best.added and not finding.rival:
            return _runners_up(finding)
    return []


def _same_size(finding: Finding) -> list[Explanation]:
    """Sets as large that hold a name which could stand in place of one, unless no run tells the two apart."""
    best = finding.best
    same = namesakes(best.fit.path, best.added, finding.problem.channel, finding.problem.scales)
    groups = zip(finding.alternatives, same, strict=True)
    names = {name for group, alike in groups for name in group if name not in alike}
    ranked = (e for e in finding.ranking if len(e.added) == len(best.added) and e is not best)
    return [e for e in ranked if names & set(e.added)][:2]


def _instead(finding: Finding) -> list[Explanation]:
    """The effects that could stand where parameters were refitted."""
    return [e for e in finding.ranking if len(e.added) == 1 and e.added[0] in finding.alternatives[0]][:2]


def _runners_up(finding: Finding) -> list[Explanation]:
    """The next best that leaves about as little."""
    most = AS_LITTLE * finding.best.fit.rss
    others = (e for e in finding.ranking if e.inside and e.added and e is not finding.best)
    return [e for e in others if e.fit.rss < most][:1]
