"""All nodes of the station, wired as `dt-station run paper` does.

ros2 launch dt_station_nodes station.launch.py pace:=lockstep duration_s:=24.0 rig:=paper model:=paper
"""

from typing import List  # noqa: UP035 - launch_ros compares with it

from launch.actions import DeclareLaunchArgument, EmitEvent, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchDescription

ARGUMENTS = {
    "namespace": ("station", "namespace of every node and topic"),
    "sample_time_s": ("0.02", "time between samples, s"),
    "pace": ("realtime", "realtime, or lockstep: as fast as the machine goes"),
    "duration_s": ("24.0", "length of the run, s; 0.0: until stopped"),
    "rig": ("paper", "the virtual rig: a file, or a name in config/rigs"),
    "model": ("paper", "the twin's model: a file, or a name in config/models"),
    "feed": ("setpoints", "what drives the twin: setpoints or commands"),
    "position_mode": ("pid", "who holds the position: pid or fuzzy"),
}


def number(name: str) -> ParameterValue:
    return ParameterValue(LaunchConfiguration(name), value_type=float)


def text(name: str) -> ParameterValue:
    return ParameterValue(LaunchConfiguration(name), value_type=str)


def setpoint_readers(topic: str) -> ParameterValue:
    # a twin fed set-points reads them beside the controller
    number_of = PythonExpression(["2 if '", LaunchConfiguration("feed"), "' == 'setpoints' else 1"])
    return ParameterValue([f"['{topic}:", number_of, "']"], value_type=List[str])  # noqa: UP006


def station_node(executable: str, name: str | None = None, **parameters: object) -> Node:
    return Node(
        package="dt_station_nodes",
        executable=executable,
        name=name or executable,
        namespace=LaunchConfiguration("namespace"),
        parameters=[{"sample_time_s": number("sample_time_s"), **parameters}],
        output="screen",
    )


def generate_launch_description() -> LaunchDescription:
    bridge = station_node(
        "daq_bridge",
        pace=text("pace"),
        duration_s=number("duration_s"),
        backend="virtual",
        backend_options=ParameterValue(["{rig: ", LaunchConfiguration("rig"), "}"], value_type=str),
        followers=["shadow"],
        # both generators, both controllers, twin and shadow read the samples
        wait_for_readers=["object/state:6"],
        wait_for_nodes=6,
        exit_at_end=True,
    )
    nodes = [
        bridge,
        station_node(
            "load_generator",
            channel="load",
            shape="square",
            amplitude=1.5e6,
            offset=3.0e6,
            frequency_hz=0.25,
            wait_for_readers=setpoint_readers("load/setpoint"),
        ),
        station_node(
            "load_generator",
            "position_generator",
            channel="position",
            offset=0.0,
            wait_for_readers=setpoint_readers("position/setpoint"),
        ),
        station_node("pressure_controller", config="pressure_pi", wait_for_readers=["load/command:1"]),
        station_node("position_controller", mode=text("position_mode"), wait_for_readers=["position/command:1"]),
        station_node(
            "twin_simulator", model=text("model"), feed=text("feed"), wait_for_readers=["twin/state:1"]
        ),
        station_node("shadow_compare"),
    ]  # fmt: skip
    over = RegisterEventHandler(
        OnProcessExit(target_action=bridge, on_exit=[EmitEvent(event=Shutdown(reason="the run has ended"))])
    )
    arguments = [
        DeclareLaunchArgument(name, default_value=value, description=description)
        for name, (value, description) in ARGUMENTS.items()
    ]
    return LaunchDescription([*arguments, *nodes, over])
