"""`dt-station recover`: what is whole in a torn bag, as a bag again."""

import shutil
from pathlib import Path
from typing import Annotated

import typer

from .common import JsonOption, UserError, emit_json


def recover(
    bag: Annotated[Path, typer.Argument(help="The torn or damaged bag: its folder, or one .mcap file.")],
    *,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="New bag [default: <bag>-recovered].")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an earlier recovery in --out.")] = False,
    json: JsonOption = False,
) -> None:
    """Save what can be read of a torn bag: every chunk that passes its checksum; the bag itself is left alone.

    Example: dt-station recover runs/demo/pid
    """
    from ..records.recovery import RECOVERY
    from ..records.recovery import recover as run_recovery
    from ..records.rosbag2 import NAME

    folder = out if out is not None else bag.with_name(f"{bag.stem if bag.is_file() else bag.name}-recovered")
    if not bag.exists():
        raise UserError(f"{bag}: no such file or directory")
    if folder.exists():
        if not force:
            raise UserError(f"{folder} exists already; name another folder with --out, or add --force")
        metadata = folder / NAME
        if not metadata.is_file() or RECOVERY not in metadata.read_text(encoding="utf-8", errors="replace"):
            raise UserError(f"{folder} is not a bag that recover made; remove it yourself")
    found = run_recovery(bag, folder if not force else _fresh(folder))
    if json:
        emit_json(
            {
                "bag": found.out,
                "complete": found.complete,
                "torn": found.torn,
                "messages": found.messages,
                "chunks": found.chunks,
                "damaged_chunks": found.damaged_chunks,
                "skipped_bytes": found.skipped_bytes,
                "orphans": found.orphans,
                "topics": {t.name: {"messages": t.messages, "missing": t.missing} for t in found.topics},
                "summary": found.sentence(),
            }
        )
        return
    print(found.sentence())
    for topic in found.topics:
        print(f"  {topic.name}: {topic.messages} messages" + (f", {topic.missing} missing" if topic.missing else ""))


def _fresh(folder: Path) -> Path:
    if folder.exists():
        shutil.rmtree(folder)
    return folder
