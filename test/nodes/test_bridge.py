"""The DAQ bridge alone, before an object that answers with the voltages it got."""

import math

import pytest

from dt_station_nodes.core.samples import ControlMode, SampleFlag, ValveCommand
from dt_station_nodes.nodes.parameters import ParameterError
from support.graph import Graph

FAKE = {"backend": "fake", "pace": "lockstep"}


def command(sequence, voltage):
    return ValveCommand(sequence, 0, voltage, 0.0, ControlMode.MANUAL, False)


@pytest.fixture
def graph():
    with Graph() as made:
        yield made


def answer(graph, bridge, heard, count):
    """Answer every sample with its number (load) and ten times it (position)."""
    load, position = graph.speak("load/command"), graph.speak("position/command")
    for k in range(count):
        graph.until(lambda k=k: len(heard) > k)
        load(command(k, float(k)))
        position(command(k, 0.1 * k))
    graph.until(lambda: bridge.ended)


def test_commands_act_at_once_and_show_in_the_next_sample(graph):
    heard = graph.listen("object/state")
    bridge = graph.add("daq_bridge", **FAKE, duration_s=0.2, wait_for_readers=["object/state:1"])
    answer(graph, bridge, heard, 10)
    graph.until(lambda: len(heard) == 11)
    assert [s.sequence for s in heard] == list(range(11))
    assert [s.load_voltage_v for s in heard] == [0.0, *map(float, range(10))]
    assert [s.pressure_pa for s in heard[1:]] == [1e6 * k for k in range(10)]
    assert [s.stamp_ns - heard[0].stamp_ns for s in heard] == [k * 20_000_000 for k in range(11)]
    assert heard[-1].flags == SampleFlag.END
    assert all(s.flags is SampleFlag.OK for s in heard[:-1])
    assert bridge.statistics.values()["missed_samples"] == 0


def test_the_rule_of_one_sample_of_delay_for_cards_that_latch(graph):
    heard = graph.listen("object/state")
    bridge = graph.add("daq_bridge", **FAKE, duration_s=0.2, command_delay=1, wait_for_readers=["object/state:1"])
    answer(graph, bridge, heard, 10)
    graph.until(lambda: len(heard) == 11)
    assert [s.load_voltage_v for s in heard] == [0.0, 0.0, *map(float, range(9))]


def test_a_missing_or_meaningless_command_is_a_fault_not_a_hang(graph):
    heard = graph.listen("object/state")
    bridge = graph.add(
        "daq_bridge",
        **FAKE,
        duration_s=0.1,
        command_timeout_s=0.05,
        patience=2,
        expect=["load"],
        wait_for_readers=["object/state:1"],
    )
    load = graph.speak("load/command")
    graph.until(lambda: heard)
    load(command(0, math.nan))
    graph.until(lambda: bridge.ended)
    graph.until(lambda: len(heard) == 6)
    assert all(SampleFlag.LOAD_COMMAND_MISSED in s.flags for s in heard[1:])
    assert bridge.statistics.values()["missed_pressure"] == 5


def test_lockstep_that_is_held_takes_no_sample_until_it_is_let_go(graph):
    heard = graph.listen("object/state")
    graph.add("daq_bridge", **FAKE, held=True, wait_for_readers=["object/state:1"])
    load, position = graph.speak("load/command"), graph.speak("position/command")
    graph.quiet()
    assert not heard
    assert graph.set_parameters("daq_bridge", held=False).successful
    graph.until(lambda: len(heard) == 1)
    assert graph.set_parameters("daq_bridge", held=True).successful
    load(command(0, 1.0))
    position(command(0, 1.0))
    graph.quiet()
    assert len(heard) == 1
    assert graph.set_parameters("daq_bridge", held=False).successful
    graph.until(lambda: len(heard) == 2)
    assert (heard[1].flags, heard[1].load_voltage_v) == (SampleFlag.OK, 1.0)


def test_lockstep_stops_before_a_given_sample_and_goes_on_to_another(graph):
    heard = graph.listen("object/state")
    graph.add("daq_bridge", **FAKE, held_from=0, expect=["nobody"], wait_for_readers=["object/state:1"])
    graph.quiet()
    assert not heard
    for number in (3, 10):
        assert graph.set_parameters("daq_bridge", held_from=number).successful
        graph.until(lambda number=number: len(heard) == number)
        graph.quiet()
        assert [s.sequence for s in heard] == list(range(number))


def test_real_time_cannot_be_held(graph):
    graph.add("daq_bridge", backend="fake", wait_for_readers=["object/state:1"])
    for changes in ({"held": True}, {"held_from": 9}):
        refused = graph.set_parameters("daq_bridge", **changes)
        assert not refused.successful
        assert "lockstep" in refused.reason


def test_real_time_holds_the_period(graph):
    graph.listen("object/state")
    bridge = graph.add(
        "daq_bridge", backend="fake", sample_time_s=0.01, duration_s=0.3, expect=["load"],
        wait_for_readers=["object/state:1"],
    )  # fmt: skip
    graph.until(lambda: bridge.ended)
    values = bridge.statistics.values()
    assert values["samples"] == 31
    assert values["wall_s"] == pytest.approx(0.31, abs=0.1)


def test_a_finite_source_ends_the_run(graph):
    heard = graph.listen("object/state")
    bridge = graph.add(
        "daq_bridge",
        **FAKE,
        backend_options="{samples: 4}",
        command_timeout_s=0.01,
        wait_for_readers=["object/state:1"],
    )
    graph.until(lambda: bridge.ended)
    graph.until(lambda: len(heard) == 4)
    assert SampleFlag.END in heard[-1].flags


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"backend": "nowhere"}, "nowhere"),
        ({"expect": ["speed"]}, "speed"),
        ({"followers": ["moon"]}, "moon"),
        ({"backend_options": "[1"}, "YAML"),
        ({"backend_options": "7"}, "mapping"),
        ({"wait_for_readers": ["object/state"]}, "TOPIC:NUMBER"),
        ({"wait_for_readers": ["x/y:1"]}, "x/y"),
        ({"pace": "slow"}, "lockstep"),
    ],
)
def test_wrong_parameters_are_refused_in_a_sentence(graph, wrong, word):
    with pytest.raises(ValueError, match=word) as caught:
        graph.add("daq_bridge", **{**FAKE, **wrong})
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, ValueError | ParameterError)
