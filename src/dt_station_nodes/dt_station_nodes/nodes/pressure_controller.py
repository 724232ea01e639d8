"""Controls the load pressure: PI on the relief valve."""

from rclpy.node import Node

from ..core.channels import Channel
from .controller import Controller, Wiring
from .spinning import run_node

NAME = "pressure_controller"
WIRING = Wiring(Channel.PRESSURE, "load/setpoint", "load/command", "pressure_pi", (), 1.0e6)


def make(node: Node) -> Controller:
    """The node's own half."""
    return Controller(node, WIRING)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(NAME, make, args)
