"""The set-point that stands, for a reader that comes after it was said: of a generator that is switched off."""

from collections.abc import Callable

from rclpy.clock import Clock, ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node

from dt_station_msgs.msg import Setpoint

from ..core import samples
from . import convert
from .qos import LATCHED

_LISTEN_S = 5.0


class StandingSetpoint:
    """Hands the latched set-point of a topic to `offer`, as long as `heard` says that none has come.

    Only at the start: whatever is said later, the ordinary reader hears.
    """

    def __init__(
        self, node: Node, topic: str, offer: Callable[[samples.Setpoint], None], heard: Callable[[], bool]
    ) -> None:
        self._node, self._offer, self._heard = node, offer, heard
        # publishers that keep nothing do not match it, which is no mistake
        silent = SubscriptionEventCallbacks(use_default_callbacks=False)
        self._reader = node.create_subscription(
            Setpoint, topic, self._on_setpoint, LATCHED, raw=True, event_callbacks=silent
        )
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(_LISTEN_S, self._end, clock=steady)

    def _on_setpoint(self, data: bytes) -> None:
        setpoint = convert.setpoint_from_bytes(data)
        if not setpoint.streaming and not self._heard():
            self._offer(setpoint)

    def _end(self) -> None:
        self._timer.cancel()
        self._node.destroy_subscription(self._reader)
