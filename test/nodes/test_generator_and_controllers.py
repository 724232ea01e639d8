"""Load generator, controllers, twin and shadow, each alone over DDS."""

import pytest
from rcl_interfaces.srv import DescribeParameters

from dt_station_msgs.msg import ShadowSummary, TwinModel, Waveform
from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.samples import ControlMode, PlantSample, SampleFlag, Setpoint
from dt_station_nodes.core.waveforms import Shape, waveform_samples
from dt_station_nodes.core.waveforms import Waveform as PureWaveform
from dt_station_nodes.nodes import qos
from support.graph import Graph


def sample(sequence, position=0.0, pressure=1e6, flags=SampleFlag.OK):
    return PlantSample(sequence, 20_000_000 * sequence, position, pressure, 0.0, 0.0, flags)


@pytest.fixture
def graph():
    with Graph() as made:
        yield made


def test_the_generator_plays_its_waveform_and_changes_live(graph):
    heard = graph.listen("load/setpoint")
    graph.add("load_generator", shape="sine", amplitude=2.0, frequency_hz=0.5, wait_for_readers=["load/setpoint:1"])
    state = graph.speak("object/state")
    for k in range(50):
        state(sample(k))
    graph.until(lambda: len(heard) == 51)
    wanted = waveform_samples(PureWaveform(Shape.SINE, 2.0, 0.0, 0.5), 0.02, 52)
    assert [s.sequence for s in heard] == list(range(51))
    assert [s.value for s in heard] == list(wanted[:51])
    assert heard[-1].stamp_ns == 49 * 20_000_000

    publisher = graph.probe.create_publisher(Waveform, "load/waveform", 10)
    graph.until(lambda: publisher.get_subscription_count() == 1)
    publisher.publish(Waveform(shape=Waveform.SHAPE_SINE, amplitude=4.0, offset=1.0, frequency=0.5))
    graph.quiet()
    state(sample(50))
    graph.until(lambda: len(heard) == 52)
    assert heard[-1].value - 1.0 == pytest.approx(2.0 * wanted[51], rel=1e-12)
    publisher.publish(Waveform(shape=Waveform.SHAPE_SINE, amplitude=-1.0, frequency=0.5))
    publisher.publish(Waveform(shape=9, frequency=0.5))
    graph.quiet()
    state(sample(51))
    graph.until(lambda: len(heard) == 53)
    assert heard[-1].value > 0.0


def test_switched_off_it_leaves_a_standing_setpoint_and_falls_silent(graph):
    heard = graph.listen("position/setpoint")
    graph.add("load_generator", channel="position", offset=0.05, wait_for_readers=["position/setpoint:1"])
    state = graph.speak("object/state")
    state(sample(0))
    graph.until(lambda: len(heard) == 2)
    assert graph.set_parameters("load_generator", enabled=False).successful
    graph.until(lambda: len(heard) == 3)
    assert (heard[-1].streaming, heard[-1].value) == (False, 0.05)
    state(sample(1))
    graph.quiet()
    assert len(heard) == 3


def test_a_controller_that_comes_late_hears_the_setpoint_that_stands(graph):
    graph.add("load_generator", offset=2.5e6, enabled=False)
    commands, states = graph.listen("load/command"), graph.listen("twin/state")
    graph.quiet(0.3)
    graph.add("pressure_controller", setpoint=1e6, wait_for_readers=["load/command:1"])
    twin = graph.add("twin_simulator", feed="setpoints", wait_for_readers=["twin/state:1"])
    state = graph.speak("object/state", readers=3)
    graph.until(lambda: twin._heard_setpoint(Channel.PRESSURE))
    state(sample(0))
    state(sample(1))
    graph.until(lambda: len(commands) == 2)
    assert [c.setpoint for c in commands] == [2.5e6, 2.5e6]
    graph.until(lambda: len(states) == 2)


def test_parameters_are_described_ranged_and_judged_as_a_whole(graph):
    generator = graph.add("load_generator")
    client = graph.probe.create_client(DescribeParameters, "/station/load_generator/describe_parameters")
    graph.until(client.service_is_ready)
    names = ["frequency_hz", "channel", "shape"]
    future = client.call_async(DescribeParameters.Request(names=names))
    graph.until(future.done)
    frequency, channel, shape = future.result().descriptors
    assert frequency.description.endswith("[Hz]")
    assert frequency.floating_point_range[0].to_value == 1e4
    assert channel.read_only
    assert "sawtooth" in shape.additional_constraints

    refused = graph.set_parameters("load_generator", amplitude=5.0, shape="zigzag")
    assert not refused.successful
    assert "zigzag" in refused.reason
    assert generator._parameters.values["amplitude"] == 0.0
    assert graph.set_parameters("load_generator", amplitude=5, shape="sine").successful
    assert generator._parameters.config.waveform.amplitude == 5.0


def test_the_pressure_controller_answers_each_sample_once_with_its_setpoint(graph):
    heard = graph.listen("load/command")
    graph.add("pressure_controller", wait_for_readers=["load/command:1"])
    setpoint, state = graph.speak("load/setpoint"), graph.speak("object/state")
    for k in range(20):
        setpoint(Setpoint(k, 0, 2e6 + k, True))
        state(sample(k))
        state(sample(k))
    graph.until(lambda: len(heard) == 20)
    assert [c.sequence for c in heard] == list(range(20))
    assert [c.setpoint for c in heard] == [2e6 + k for k in range(20)]
    assert {c.mode for c in heard} == {ControlMode.PI}
    assert heard[3].stamp_ns == 3 * 20_000_000
    setpoint(Setpoint(0, 0, 3e6, False))
    graph.quiet()
    state(sample(20))
    graph.until(lambda: len(heard) == 21)
    assert heard[-1].setpoint == 3e6


def test_the_position_controller_switches_live_and_without_a_bump(graph):
    heard = graph.listen("position/command")
    graph.add("position_controller", setpoint=0.01, wait_for_readers=["position/command:1"])
    state = graph.speak("object/state")
    for k in range(5):
        state(sample(k, position=0.005))
    graph.until(lambda: len(heard) == 5)
    assert graph.set_parameters("position_controller", mode="fuzzy").successful
    state(sample(5, position=0.005))
    graph.until(lambda: len(heard) == 6)
    assert [c.mode for c in heard[4:]] == [ControlMode.PID, ControlMode.FUZZY]
    assert heard[5].voltage_v == pytest.approx(heard[4].voltage_v, abs=0.2)
    refused = graph.set_parameters("position_controller", **{"limits.lower_v": 11.0})
    assert not refused.successful
    assert "lower_v" in refused.reason
    assert graph.set_parameters("position_controller", mode="manual").successful


def test_the_twin_follows_takes_a_new_model_live_and_tells_latecomers(graph):
    heard = graph.listen("twin/state")
    twin = graph.add("twin_simulator", feed="commands", wait_for_readers=["twin/state:1"])
    state = graph.speak("object/state")
    for k in range(10):
        state(sample(k, position=0.1, pressure=1.5e6))
    graph.until(lambda: len(heard) == 10)
    assert heard[0].position_m == pytest.approx(0.1)
    assert [s.stamp_ns for s in heard] == [20_000_000 * k for k in range(10)]
    models = []
    graph.probe.create_subscription(TwinModel, "twin/model", models.append, qos.LATCHED)
    graph.until(lambda: models)
    assert models[0].name == "paper"
    text = models[0].yaml.replace("name: paper", "name: other")
    assert graph.set_parameters("twin_simulator", model_yaml=text).successful
    graph.until(lambda: len(models) == 2)
    assert models[1].name == "other"
    assert models[1].sha256 != models[0].sha256
    refused = graph.set_parameters("twin_simulator", model_yaml="name: [")
    assert not refused.successful
    state(sample(10, position=0.2))
    graph.until(lambda: len(heard) == 11)
    assert heard[-1].position_m == pytest.approx(0.2)
    assert twin._config.spec.name == "other"


def test_the_shadow_compares_pairs_and_sums_up_at_the_end(graph):
    heard = graph.listen("shadow/residual")
    graph.add("shadow_compare", wait_for_readers=["shadow/residual:1"])
    measured, simulated = graph.speak("object/state"), graph.speak("twin/state")
    for k in range(10):
        measured(sample(k, position=0.1 + 0.01 * k, flags=SampleFlag.END if k == 9 else SampleFlag.OK))
        simulated(sample(k, position=0.1))
    graph.until(lambda: len(heard) == 10)
    assert heard[-1].position[0] == pytest.approx(0.09)
    assert heard[-1].position[1] == pytest.approx(0.02 * sum((0.01 * k) ** 2 for k in range(10)))
    late = []
    graph.probe.create_subscription(ShadowSummary, "shadow/summary", late.append, qos.LATCHED)
    graph.until(lambda: late)
    assert (late[0].samples, late[0].missed) == (10, 0)
