"""Nodes in this process, over real DDS: one context, one executor, whatever a test adds."""

import time

import rclpy
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from dt_station_msgs.msg import PlantState, Residual, Setpoint, ValveCommand
from dt_station_nodes.nodes import convert, qos
from dt_station_nodes.nodes.dds_profile import use_profile
from dt_station_nodes.nodes.registry import factory
from dt_station_nodes.nodes.spinning import make_executor

WIRES = {
    "object/state": (PlantState, convert.state_to_bytes, convert.state_from_bytes, qos.STREAM),
    "twin/state": (PlantState, convert.state_to_bytes, convert.state_from_bytes, qos.STREAM),
    "load/setpoint": (Setpoint, convert.setpoint_to_bytes, convert.setpoint_from_bytes, qos.SETPOINT_READER),
    "position/setpoint": (Setpoint, convert.setpoint_to_bytes, convert.setpoint_from_bytes, qos.SETPOINT_READER),
    "load/command": (ValveCommand, convert.command_to_bytes, convert.command_from_bytes, qos.STREAM),
    "position/command": (ValveCommand, convert.command_to_bytes, convert.command_from_bytes, qos.STREAM),
    "shadow/residual": (Residual, convert.residual_to_bytes, convert.residual_from_bytes, qos.STREAM),
}


class Graph:
    """`with Graph() as graph`: add nodes, listen, publish, spin until something holds."""

    def __init__(self):
        use_profile()
        self.context = Context()
        self.parts = []
        self._nodes = []

    def __enter__(self):
        rclpy.init(args=[], context=self.context, signal_handler_options=SignalHandlerOptions.NO)
        self.executor = make_executor(self.context)
        self.probe = self.node("probe")
        return self

    def __exit__(self, *_):
        for part in self.parts:
            part.close()
        for node in self._nodes:
            self.executor.remove_node(node)
        self.executor.shutdown()
        for node in self._nodes:
            node.destroy_node()
        rclpy.try_shutdown(context=self.context)

    def node(self, name, **parameters):
        overrides = [Parameter(key, value=value) for key, value in parameters.items()]
        made = Node(
            name,
            namespace="station",
            context=self.context,
            parameter_overrides=overrides,
            use_global_arguments=False,
            enable_rosout=False,
        )
        self._nodes.append(made)
        self.executor.add_node(made)
        return made

    def add(self, executable, name=None, **parameters):
        """One of the station's nodes."""
        part = factory(executable)(self.node(name or executable, **parameters))
        self.parts.append(part)
        return part

    def listen(self, topic):
        """A list that fills with what is said."""
        kind, _, decode, profile = WIRES[topic]
        heard = []
        self.probe.create_subscription(kind, topic, lambda data: heard.append(decode(data)), profile, raw=True)
        return heard

    def speak(self, topic, readers=1):
        """A function that publishes, once there are readers."""
        kind, encode, _, profile = WIRES[topic]
        publisher = self.probe.create_publisher(kind, topic, profile)
        self.until(lambda: publisher.get_subscription_count() >= readers)
        # the reader hears of its writer a little later than the writer of its reader
        self.quiet(0.05)
        return lambda value: publisher.publish(encode(value))

    def set_parameters(self, node, **values):
        """Through the service, as `ros2 param set` does; the result."""
        client = self.probe.create_client(SetParametersAtomically, f"/station/{node}/set_parameters_atomically")
        self.until(client.service_is_ready)
        parameters = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
        future = client.call_async(SetParametersAtomically.Request(parameters=parameters))
        self.until(future.done)
        return future.result().result

    def until(self, condition, timeout_s=20.0):
        """Spin until it holds."""
        end = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < end, "it did not come to pass"
            self._step(0.05)

    def quiet(self, duration_s=0.15):
        """Spin for a while, to see that nothing comes."""
        end = time.monotonic() + duration_s
        while time.monotonic() < end:
            self._step(0.02)

    def _step(self, longest_s):
        wait_s = longest_s
        for part in self.parts:
            if part.ticker is not None and (deadline := part.ticker.deadline_ns()) is not None:
                left_s = (deadline - time.perf_counter_ns()) * 1e-9
                if left_s <= 0.0:
                    part.ticker.tick()
                    left_s = 0.0
                wait_s = min(wait_s, left_s)
        self.executor.spin_once(timeout_sec=max(0.0, wait_s))
