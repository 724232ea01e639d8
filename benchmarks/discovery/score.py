"""Score discovery on hidden runs.

`python -m benchmarks.discovery.score --set standard --seed 1 --page docs/confusion.md`
"""

import json
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import joblib
import typer
from rich.progress import track

from dt_station_nodes.core.models import ModelSpec

from .confusion import label, page, said
from .examine import examine
from .generate import Set
from .generate import main as generate
from .judge import Judged, Outcome, figures

ROOT = Path(__file__).resolve().parents[2]
GOOD = (Outcome.EXACT, Outcome.SILENT)


def failures(cases: list[Judged]) -> str:
    """Every case that did not end exactly right, one line each."""
    lines = []
    for c in sorted(cases, key=lambda c: (c.kind, c.truth, c.number)):
        expected = {"null": "nothing_missing", "mismatch": "parameters_only"}.get(c.kind, c.verdict)
        if c.outcome in GOOD and c.verdict == expected != "error":
            continue
        truth = " + ".join(label(t) for t in c.truth) or "(nothing)"
        extra = f" alternatives {', '.join(c.alternatives)}" if c.alternatives else ""
        ratio = "" if c.ratio is None else f" gap/noise {c.ratio:.2f}"
        error = f" ERROR {c.error.splitlines()[-1]}" if c.error else ""
        lines.append(
            f"- {c.number} {c.kind}: {truth} ({c.family} severity {c.severity} {c.shape} {c.noise_db} dB, "
            f"gap {c.visibility:.1f} times 1 %) -> {said(c)}{extra} "
            f"[{c.outcome.value}, confidence {c.confidence:.2f}{ratio}, {c.seconds:.1f} s]{error}"
        )
    return "\n".join(lines)


def main(  # noqa: PLR0917
    cases: Annotated[Path | None, typer.Option(help="a set made before; else one is made and thrown away")] = None,
    which: Annotated[Set, typer.Option("--set", help="the set to make")] = Set.STANDARD,
    seed: Annotated[int, typer.Option(help="seed of the set to make")] = 1,
    seconds: Annotated[float | None, typer.Option(help="length of the runs to make; else 24 to 60 s, drawn")] = None,
    model: Annotated[Path, typer.Option(help="the nominal model")] = ROOT / "config" / "models" / "paper.yaml",
    validate: Annotated[bool, typer.Option(help="give discovery the validation run too")] = True,
    follow: Annotated[bool, typer.Option(help="run the proposed experiments and discover again")] = False,
    kind: Annotated[str | None, typer.Option(help="only cases of this kind")] = None,
    limit: Annotated[int | None, typer.Option(help="only so many cases")] = None,
    jobs: Annotated[int, typer.Option(help="cases at a time")] = 2,
    out: Annotated[Path | None, typer.Option("--page", help="the page to write, with a .json beside it")] = None,
    keep: Annotated[
        Path | None, typer.Option(help="judged cases, one JSON line each; those in it are not done again")
    ] = None,
    failed: Annotated[Path | None, typer.Option(help="where to list what went wrong")] = None,
) -> None:
    """Discover every case, print the figures, write the page."""
    with tempfile.TemporaryDirectory() as spare:
        if cases is None:
            cases = Path(spare) / "set"
            generate(cases, which, seed, seconds)
            command = f"python -m benchmarks.discovery.score --set {which.value} --seed {seed} --page {out}"
            if seconds is not None:
                command += f" --seconds {seconds:g}"
        else:
            command = f"python -m benchmarks.discovery.score --cases {cases} --page {out}"
        if follow:
            command += " --follow"
        truth: dict[str, Any] = json.loads((cases / "truth" / "truth.json").read_text())["cases"]
        chosen = [n for n, t in truth.items() if kind is None or t["kind"].startswith(kind)][:limit]
        judged = (
            [] if keep is None or not keep.exists() else [Judged.from_json(x) for x in keep.read_text().splitlines()]
        )
        done = {case.number for case in judged}
        left = [n for n in chosen if n not in done]
        spec = ModelSpec.from_yaml(model.read_text(), str(model))
        work = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered")(
            joblib.delayed(examine)(n, cases / "runs" / n, truth[n], spec, validate, follow) for n in left
        )
        try:
            for case in track(work, "discovering", total=len(left)):
                judged.append(case)
                if keep is not None:
                    with keep.open("a") as file:
                        file.write(json.dumps(case.to_json()) + "\n")
                if failed is not None:
                    failed.write_text(f"{len(judged)} of {len(chosen)} cases\n{failures(judged)}\n")
        except KeyboardInterrupt:
            typer.echo(f"stopped after {len(judged)} of {len(chosen)} cases")
        judged.sort(key=lambda c: c.number)
    report = figures(judged)
    summary = "\n".join(
        f"{f.what}: {'-' if f.value is None else f'{f.value:.1f}'} ({f.aim}; {f.count})" for f in report
    )
    typer.echo(summary)
    if failed is not None:
        failed.write_text(f"{summary}\n{failures(judged)}\n")
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(page(judged, report, command))
        data = {"figures": [asdict(f) for f in report], "cases": [c.to_json() for c in judged]}
        out.with_suffix(".json").write_text(json.dumps(data, indent=1))


if __name__ == "__main__":
    typer.run(main)
