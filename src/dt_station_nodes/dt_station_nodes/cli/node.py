"""`dt-station node`: one node, as `ros2 run` starts it."""

import typer

from .common import UserError, leave

CONTEXT_SETTINGS = {"ignore_unknown_options": True, "allow_extra_args": True}


def node(
    context: typer.Context,
    name: str = typer.Argument("", help="The node, such as daq_bridge; without one, all are listed."),
) -> None:
    """Start one node in this process; what follows its name is the node's own, as with ros2 run.

    Example: dt-station node load_generator --ros-args -p shape:=sine -p amplitude:=1e6
    """
    from ..nodes.registry import entry, installed

    if not name:
        for each in installed():
            print(each)
        return
    if context.args and context.args[0] != "--ros-args":
        raise UserError(
            f"{context.args[0]!r} is not understood; parameters follow --ros-args, such as -p pace:=lockstep."
        )
    leave(entry(name)([name, *context.args]))
