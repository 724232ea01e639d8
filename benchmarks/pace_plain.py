"""A plain rclpy graph of the station's shape: message objects, timers, rclpy.spin. Prints one JSON object.

Seven processes as a user would write them: a bridge on a timer, two generators, two controllers, a twin and a
comparison. No physics at all, so its missed samples are rclpy's own. Forked before rclpy starts.
"""

import argparse
import contextlib
import json
import os
import signal
import sys
import time

import rclpy
from rclpy.node import Node

from dt_station_msgs.msg import PlantState, Residual, Setpoint, ValveCommand


class Bridge(Node):
    def __init__(self, period_s: float, samples: int) -> None:
        super().__init__("plain_bridge")
        self.samples, self.sequence, self.missed = samples, -1, 0
        self.answered: dict[str, int] = {"load": -1, "position": -1}
        self.latency: list[float] = []
        self.taken = 0.0
        self.publisher = self.create_publisher(PlantState, "object/state", 200)
        for name in self.answered:
            self.create_subscription(ValveCommand, f"{name}/command", lambda m, n=name: self.on_command(n, m), 200)
        self.period_s = period_s
        self.timer = None

    def start(self) -> None:
        self.timer = self.create_timer(self.period_s, self.tick)

    def tick(self) -> None:
        if self.sequence >= 0 and any(number != self.sequence for number in self.answered.values()):
            self.missed += 1
        self.sequence += 1
        message = PlantState(sequence=self.sequence, pressure=1e6)
        message.header.stamp = self.get_clock().now().to_msg()
        self.taken = time.perf_counter()
        self.publisher.publish(message)

    def on_command(self, name: str, message: ValveCommand) -> None:
        self.answered[name] = message.sequence
        if all(number == self.sequence for number in self.answered.values()):
            self.latency.append(time.perf_counter() - self.taken)


def reacting(name: str, inputs: dict, output: tuple | None, make) -> None:
    node = Node(name)
    publisher = node.create_publisher(output[0], output[1], 200) if output else None

    def react(message) -> None:
        if publisher is not None:
            publisher.publish(make(message))

    for topic, (kind, acts) in inputs.items():
        node.create_subscription(kind, topic, react if acts else (lambda _: None), 200)
    rclpy.spin(node)


def setpoint(state: PlantState) -> Setpoint:
    return Setpoint(header=state.header, sequence=state.sequence + 1, value=1.0, streaming=True)


def command(state: PlantState) -> ValveCommand:
    return ValveCommand(header=state.header, sequence=state.sequence, voltage=1.0)


def simulated(state: PlantState) -> PlantState:
    return PlantState(header=state.header, sequence=state.sequence)


def residual(state: PlantState) -> Residual:
    return Residual(header=state.header, sequence=state.sequence)


# topic -> type, and whether the node answers to it
STATE = {"object/state": (PlantState, True)}
LOAD = {"load/setpoint": (Setpoint, False)}
POSITION = {"position/setpoint": (Setpoint, False)}
TWIN = {"twin/state": (PlantState, True)}
NODES = (
    ("load_generator", STATE, (Setpoint, "load/setpoint"), setpoint),
    ("position_generator", STATE, (Setpoint, "position/setpoint"), setpoint),
    ("pressure_controller", {**STATE, **LOAD}, (ValveCommand, "load/command"), command),
    ("position_controller", {**STATE, **POSITION}, (ValveCommand, "position/command"), command),
    ("twin_simulator", {**STATE, **LOAD, **POSITION}, (PlantState, "twin/state"), simulated),
    ("shadow_compare", {"object/state": (PlantState, False), **TWIN}, (Residual, "shadow/residual"), residual),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rate", type=float, required=True)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--priority", action="store_true")
    given = parser.parse_args()
    if given.priority:
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
    children = []
    for arguments in NODES:
        child = os.fork()
        if child == 0:
            try:
                rclpy.init()
                reacting(*arguments)
            except BaseException:
                os._exit(0)
            os._exit(0)
        children.append(child)
    rclpy.init()
    samples = round(given.seconds * given.rate)
    bridge = Bridge(1.0 / given.rate, samples)
    end = time.monotonic() + 30.0
    while bridge.publisher.get_subscription_count() < 6 and time.monotonic() < end:
        rclpy.spin_once(bridge, timeout_sec=0.05)
    settle = time.monotonic() + 0.5
    while time.monotonic() < settle:
        rclpy.spin_once(bridge, timeout_sec=0.05)
    bridge.start()
    while bridge.sequence < samples:
        rclpy.spin_once(bridge)
    for child in children:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    ordered = sorted(bridge.latency)
    count = len(ordered)
    result = {
        "samples": samples,
        "missed": bridge.missed,
        **{f"p{share}_s": ordered[min(count - 1, share * count // 100)] if count else None for share in (50, 99)},
        "max_s": ordered[-1] if count else None,
    }
    print(json.dumps(result))
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
