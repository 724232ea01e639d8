"""Controls the position: PID or fuzzy on the servo valve, switchable live."""

from rclpy.node import Node

from ..core.channels import Channel
from .controller import Controller, Wiring
from .spinning import run_node

NAME = "position_controller"
WIRING = Wiring(Channel.POSITION, "position/setpoint", "position/command", "position_pid", ("position_fuzzy",), 0.0)


def make(node: Node) -> Controller:
    """The node's own half."""
    return Controller(node, WIRING)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(NAME, make, args)
