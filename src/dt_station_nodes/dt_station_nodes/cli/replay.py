"""`dt-station replay`: a bag back into the graph."""

from pathlib import Path
from typing import Annotated

import typer

from .common import JsonOption, UserError, console, emit_json, leave


def replay(
    bag: Annotated[Path, typer.Argument(help="The bag to play.")],
    *,
    rate: Annotated[float, typer.Option(min=0.0, help="Speed; 0: as fast as possible.")] = 1.0,
    from_s: Annotated[float, typer.Option("--from", min=0.0, help="Start of the stretch, s.")] = 0.0,
    to_s: Annotated[float, typer.Option("--to", min=0.0, help="End of the stretch, s; 0: the bag's end.")] = 0.0,
    topic: Annotated[list[str] | None, typer.Option(help="Play only these; repeatable.")] = None,
    remap: Annotated[list[str] | None, typer.Option(help="Play under another name, OLD=NEW; repeatable.")] = None,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Play each sample once twin and shadow have answered the last.")
    ] = False,
    follower: Annotated[
        list[str] | None, typer.Option(help="Lockstep with only these: twin, shadow; repeatable.")
    ] = None,
    loop: Annotated[bool, typer.Option("--loop", help="Begin anew at the end.")] = False,
    paused: Annotated[bool, typer.Option("--paused", help="Start standing still.")] = False,
    clock: Annotated[bool, typer.Option(help="Publish /clock.")] = True,
    readers: Annotated[int, typer.Option(min=0, help="Readers of the samples to wait for.")] = 1,
    wait: Annotated[float, typer.Option(min=0.0, help="How long to wait for them, s.")] = 30.0,
    json: JsonOption = False,
) -> None:
    """Play a bag in the order of its samples' numbers and stamps, once its readers are there.

    While it plays, the parameters paused and rate of the node replayer can be set and its service ~/step called.

    Example: dt-station replay runs/demo/pid --lockstep
    """
    from ..nodes import replayer
    from ..records import Bag
    from .node_call import call_node

    with Bag(bag) as opened:
        counts = {name: known.info.count for name, known in opened.topics.items()}
    followers = follower or (["twin", "shadow"] if lockstep else [])
    if lockstep or follower:
        rate = 0.0 if rate == 1.0 else rate
    if to_s and to_s <= from_s:
        raise UserError(f"--to {to_s:g} is not after --from {from_s:g}")
    settings: dict[str, object] = {
        "bag": str(bag),
        "rate": rate,
        "from_s": from_s,
        "to_s": to_s,
        "loop": loop,
        "paused": paused,
        "clock": clock,
        "least_readers": readers,
        "wait_timeout_s": wait,
    }
    lists = {"topics": topic, "remap": remap, "followers": followers}
    settings |= {name: values for name, values in lists.items() if values}
    console.print(f"playing {bag}; Ctrl-C ends")
    status = call_node(replayer.main, replayer.NAME, settings)
    if status:
        leave(status)
    if json:
        emit_json({"bag": bag, "messages": sum(counts.values()), "topics": counts})
