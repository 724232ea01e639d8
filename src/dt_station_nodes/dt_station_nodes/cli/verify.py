"""`dt-station verify`: recompute a bag's outputs from its inputs and compare them bit for bit."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .common import JsonOption, emit_json, leave, progress

if TYPE_CHECKING:
    from ..nodes.verification import Verdict


def verify(
    bag: Annotated[Path, typer.Argument(help="The bag to verify.")],
    *,
    json: JsonOption = False,
) -> None:
    """Run a bag's recorded inputs through the same classes as the live nodes and compare every output bit for bit.

    Exit status 0: identical; 1: an output differs, and the first one is shown with its topic, field and both values.
    Differences of versions or configuration files between the recording and this installation are said either way.

    Example: dt-station verify runs/demo/pid
    """
    from ..core.errors import StationError
    from ..nodes.configuration import find_config
    from ..nodes.recorded_configuration import differing_files
    from ..nodes.verification import Verifier
    from ..records import Bag
    from ..records.bagwriter import CONTEXT
    from ..records.provenance import provenance

    def installed(kind: str, name: str) -> bytes | None:
        try:
            return find_config(kind, name).read_bytes()
        except (StationError, OSError):
            return None

    with Bag(bag) as opened:
        verifier = Verifier(opened)
        verdicts = []
        with progress(f"verifying {bag}") as advance:
            for verdict in verifier.verdicts():
                verdicts.append(verdict)
                advance(1)
        then, now = opened.metadata.get(CONTEXT, {}), provenance({})
        versions = {k: (then[k], now[k]) for k in now if k in then and then[k] != now[k]}
        files = differing_files(opened, installed)
    identical = all(verdict.identical for verdict in verdicts)
    if json:
        emit_json(
            {
                "bag": bag,
                "identical": identical,
                "topics": [_values(verdict) for verdict in verdicts],
                "not_verified": verifier.skipped,
                "versions_differ": {name: {"recorded": a, "here": b} for name, (a, b) in versions.items()},
                "files_differ": files,
            }
        )
    else:
        _print(verdicts, verifier.skipped, versions, files)
    if not identical or not verdicts:
        leave(1)


def _values(verdict: "Verdict") -> dict[str, Any]:
    values: dict[str, Any] = {
        "topic": verdict.topic,
        "samples": verdict.outcome.compared,
        "identical": verdict.identical,
        "notes": verdict.outcome.notes,
    }
    if not verdict.identical:
        values["first_difference"] = {
            "sequence": verdict.sequence,
            "field": verdict.field,
            "recorded": repr(verdict.recorded),
            "computed": repr(verdict.computed),
        }
    return values


def _print(
    verdicts: "list[Verdict]", skipped: dict[str, str], versions: dict[str, tuple[str, str]], files: list[str]
) -> None:
    for verdict in verdicts:
        if verdict.identical:
            print(f"{verdict.topic}: {verdict.outcome.compared} samples, identical to the last bit")
        else:
            print(
                f"{verdict.topic}: sample {verdict.sequence} is the first to differ: {verdict.field} "
                f"recorded {verdict.recorded!r}, computed {verdict.computed!r} "
                f"({verdict.outcome.compared} samples before it are alike)"
            )
        for note in verdict.outcome.notes:
            print(f"  {note}")
    for topic, why in skipped.items():
        print(f"{topic}: not verified, {why}")
    for name, (then, now) in versions.items():
        print(f"recorded with {name} {then}, here {now}")
    for name in files:
        print(f"{name} here is not the one recorded; the recorded one was used")
    if not verdicts:
        print("nothing could be verified")
