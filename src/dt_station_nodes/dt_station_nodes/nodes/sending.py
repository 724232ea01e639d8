"""Publishing from a callback that may still run while the process is being stopped."""

from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher


def send(node: Node, publisher: Publisher, message: Any) -> None:
    """Publish a message or its bytes; nothing once the node's context has been shut down."""
    try:
        publisher.publish(message)
    except Exception:
        if node.context.ok():
            raise
