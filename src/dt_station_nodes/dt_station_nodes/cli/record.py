"""`dt-station record`: the running station into a bag."""

import time
from pathlib import Path
from typing import Annotated

import typer

from .common import Failure, JsonOption, UserError, console, emit_json, leave


def record(
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="The bag [runs/record-<time>].")] = None,
    *,
    topic: Annotated[list[str] | None, typer.Option(help="Record only these; repeatable.")] = None,
    attach: Annotated[list[Path] | None, typer.Option(help="Keep this file in the bag; repeatable.")] = None,
    duration: Annotated[float, typer.Option(min=0.0, help="Stop after so many s; 0: until Ctrl-C.")] = 0.0,
    split_mb: Annotated[float, typer.Option(min=0.0, help="Begin a new file at this size, MB; 0: never.")] = 0.0,
    split_s: Annotated[float, typer.Option(min=0.0, help="Begin a new file after so long, s; 0: never.")] = 0.0,
    until_end: Annotated[bool, typer.Option(help="Stop by itself when the run ends.")] = True,
    json: JsonOption = False,
) -> None:
    """Record the running station: serialized messages, their definitions, parameters and versions.

    Stops at the end of the run, after --duration, or at Ctrl-C. Refuses to overwrite a bag.

    Example: dt-station record --out runs/mine --split-mb 500
    """
    import os
    import signal
    import threading

    from ..nodes import recorder
    from ..records import Bag, RecordError
    from ..records.losses import LOSS, parse_loss
    from .node_call import call_node

    folder = out if out is not None else Path("runs") / f"record-{time.strftime('%Y%m%d-%H%M%S')}"
    if folder.exists():
        raise UserError(f"{folder} exists already; name another with --out")
    for path in attach or ():
        if not path.is_file():
            raise UserError(f"--attach {path}: no such file")
    settings = {
        "out": str(folder),
        "split_mb": split_mb,
        "split_s": split_s,
        "exit_at_end": until_end,
        "topics": list(topic or ()),
        "attach": [str(path) for path in attach or ()],
    }
    console.print(f"recording to {folder}; Ctrl-C ends")
    if duration:
        timer = threading.Timer(duration, os.kill, (os.getpid(), signal.SIGINT))
        timer.daemon = True
        timer.start()
    status = call_node(recorder.main, recorder.NAME, settings)
    if status:
        leave(status)
    try:
        with Bag(folder) as bag:
            counts = {name: topic.info.count for name, topic in bag.topics.items()}
            losses = {name: parse_loss(text) for name, text in bag.metadata.get(LOSS, {}).items()}
    except RecordError as error:
        raise Failure(f"the recording is not whole: {error}") from None
    lost = {name: loss.missing for name, loss in losses.items() if loss.missing}
    if json:
        emit_json({"bag": folder, "messages": sum(counts.values()), "topics": counts, "lost": lost})
        return
    print(f"{folder}: {sum(counts.values())} messages on {sum(map(bool, counts.values()))} topics")
    for name, count in lost.items():
        print(f"  {name}: {count} messages lost")
