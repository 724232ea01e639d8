"""The confusion matrix and the figures as a page."""

from collections import Counter
from collections.abc import Sequence

from .judge import Figure, Judged, Outcome

_NONE = {"nothing_missing": "nothing", "parameters_only": "parameters", "unexplained": "unexplained", "error": "error"}
_CHANNEL = {"pressure": "p", "position": "x"}


def label(pair: tuple[str, str]) -> str:
    """An effect on its channel, short."""
    return f"{pair[0]}/{_CHANNEL[pair[1]]}"


def said(case: Judged) -> str:
    """What was said, as one column of the matrix."""
    if case.verdict != "named":
        return _NONE[case.verdict]
    return " + ".join(sorted(label(pair) for pair in case.found))


def _matrix(cases: Sequence[Judged]) -> list[str]:
    rows: dict[str, Counter[str]] = {}
    for case in cases:
        if case.kind in ("single", "single_mismatch"):
            rows.setdefault(label(case.truth[0]), Counter())[said(case)] += 1
        elif case.kind in ("null", "mismatch"):
            rows.setdefault(f"({case.kind})", Counter())[said(case)] += 1
        elif case.kind == "outside":
            rows.setdefault(f"({label(case.truth[0])})", Counter())[said(case)] += 1
    out = ["| truth | cases | right | said instead |", "| --- | --- | --- | --- |"]
    for name, counts in sorted(rows.items(), key=lambda item: (item[0].startswith("("), item[0])):
        right = counts[name] if not name.startswith("(") else sum(n for k, n in counts.items() if k in _NONE.values())
        rest = {k: n for k, n in counts.items() if k != name}
        others = ", ".join(f"{k} {n}" for k, n in sorted(rest.items(), key=lambda item: (-item[1], item[0])))
        out.append(f"| {name} | {sum(counts.values())} | {right} | {others} |")
    return out


def _by(cases: Sequence[Judged], key: str) -> list[str]:
    groups: dict[str, list[Judged]] = {}
    for case in cases:
        if case.kind == "single":
            groups.setdefault(str(getattr(case, key)), []).append(case)
    out = [f"| {key} | cases | exact | in set | wrong | abstained |", "| --- | --- | --- | --- | --- | --- |"]
    for name, group in sorted(groups.items()):
        n = len(group)

        def percent(*good: Outcome, group: list[Judged] = group, n: int = n) -> str:
            return f"{100 * sum(c.outcome in good for c in group) / n:.0f} %"

        out.append(
            f"| {name} | {n} | {percent(Outcome.EXACT)} | {percent(Outcome.EXACT, Outcome.IN_SET)} | "
            f"{percent(Outcome.WRONG, Outcome.EXTRA)} | {percent(Outcome.ABSTAINED)} |"
        )
    return out


def _value(figure: Figure) -> str:
    if figure.value is None:
        return "not measured"
    return f"{figure.value:.1f} %" if "%" in figure.aim else f"{figure.value:.2f}"


def page(cases: Sequence[Judged], figures: Sequence[Figure], command: str) -> str:
    """The whole page, Markdown."""
    seconds = sorted(case.seconds for case in cases)
    lines = [
        "# How often discovery is right",
        "",
        "Hidden runs come from `benchmarks/discovery`, a plant and forms of imperfection of their own that share no",
        "code with the candidates; discovery sees a run and a validation run, never the truth.",
        "Regenerate this page with",
        "",
        f"    {command}",
        "",
        "| figure | aim | here | cases | met |",
        "| --- | --- | --- | --- | --- |",
    ]
    lines += [
        f"| {f.what} | {f.aim} | {_value(f)} | {f.count} | {'-' if f.met is None else 'yes' if f.met else '**no**'} |"
        for f in figures
    ]
    lines += [
        "",
        f"A discovery took {seconds[len(seconds) // 2]:.1f} s in the median, {seconds[-1]:.1f} s at most.",
        "",
        "## What was said",
        "",
        "`/p` is the pressure channel, `/x` position; in brackets what is not in the library: there any name is wrong.",
        "",
        *_matrix(cases),
        "",
        "## Single effects by noise (dB), severity (0 just visible, 2 dominating), waveform and family of forms",
        "",
    ]
    for key in ("noise_db", "severity", "shape", "family"):
        lines += [*_by(cases, key), ""]
    pairs = [case for case in cases if case.kind == "pair"]
    if pairs:
        lines += ["## Pairs", "", "| truth | said | outcome |", "| --- | --- | --- |"]
        lines += [
            f"| {' + '.join(sorted(label(t) for t in c.truth))} | {said(c)} | {c.outcome.value} |"
            for c in sorted(pairs, key=lambda c: (c.truth, c.number))
        ]
        lines.append("")
    return "\n".join(lines)
