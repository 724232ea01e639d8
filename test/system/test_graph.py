"""The whole graph: lockstep end to end, both paces, late join, faults, no process left behind."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dt_station_msgs.msg import ShadowSummary
from dt_station_nodes.nodes import qos
from dt_station_nodes.nodes.composition import Composition
from dt_station_nodes.nodes.scenario import NodeSpec, Scenario
from dt_station_nodes.nodes.supervisor import RunError, Supervisor
from dt_station_nodes.nodes.watch import Watch
from dt_station_nodes.records import Bag, load_run
from dt_station_nodes.records.losses import LOSS, parse_loss
from support.graph import WIRES

pytestmark = pytest.mark.timeout(120)
OUTPUTS = ("load/command", "position/command", "twin/state", "shadow/residual")


def scenario(pace="lockstep", duration_s=4.0, bag=None, **changes):
    made = Scenario.load("paper").changed(pace=pace, duration_s=duration_s, **changes)
    if bag is not None:
        made = made.with_nodes(recorder=NodeSpec(parameters={"out": str(bag)}))
    return made


def composed(made, timeout_s=60.0):
    with Composition(made) as station:
        station.wait(timeout_s)
        return station.stop()


def bodies(bag, topic):
    """Messages of a topic as exact text, without the stamps, which say when the run was."""
    decode = WIRES[topic][2]
    with Bag(bag) as opened:
        name = next(each for each in opened.topics if each.endswith(topic))
        return [repr(replace(decode(bytes(message.data)), stamp_ns=0)) for message in opened.messages([name])]


@pytest.fixture(scope="module")
def lockstep(tmp_path_factory):
    """One composed lockstep run and its bag, for several tests."""
    bag = tmp_path_factory.mktemp("lockstep") / "bag"
    return bag, composed(scenario(bag=bag))


def test_lockstep_in_one_process_misses_nothing(lockstep):
    bag, statistics = lockstep
    assert statistics.bridge["samples"] == 201
    assert statistics.bridge["missed_samples"] == 0
    assert (statistics.shadow["samples"], statistics.shadow["missed"]) == (201, 0)
    run = load_run(bag)
    assert np.abs((run.signals["pressure_pa"] - run.signals["pressure_setpoint_pa"])[-20:-1]).max() < 1e5
    assert abs(run.signals["position_m"][-1] - run.signals["position_setpoint_m"][-1]) < 1e-3


def test_separate_processes_give_the_same_bits_as_one(lockstep, tmp_path):
    with Supervisor(scenario(bag=tmp_path / "bag")) as station:
        station.wait(timeout_s=60.0)
        statistics = station.stop()
    assert set(statistics.exit_status.values()) == {0}
    assert statistics.bridge["missed_samples"] == 0
    assert statistics.bridge["phase"] == "ended"
    for topic in ("object/state", *OUTPUTS):
        assert bodies(tmp_path / "bag", topic) == bodies(lockstep[0], topic), topic


def test_both_paces_give_the_same_bits_for_the_same_samples(tmp_path):
    composed(scenario("realtime", 2.0, tmp_path / "clock"))
    replay = scenario(bag=tmp_path / "steps").with_nodes(
        daq_bridge=NodeSpec(parameters={"backend": "replay", "backend_options": {"file": str(tmp_path / "clock")}})
    )
    composed(replay.changed(duration_s=0.0))
    for topic in OUTPUTS:
        first, second = bodies(tmp_path / "clock", topic), bodies(tmp_path / "steps", topic)
        # a replay ends with the last row whose voltages are known
        assert len(second) >= 99
        assert first[: len(second)] == second, topic


def test_who_joins_late_hears_the_verdict_and_the_health():
    with Composition(scenario(duration_s=1.0)) as station:
        station.wait(60.0)
        late, heard = Watch("latecomer"), []
        try:
            late.node.create_subscription(ShadowSummary, "shadow/summary", heard.append, qos.LATCHED)
            end = time.monotonic() + 20.0
            while not heard and time.monotonic() < end:
                station._executor.spin_once(timeout_sec=0.01)
                late.spin(0.01)
        finally:
            late.close()
    assert heard
    assert heard[0].samples == 51


def test_a_killed_controller_is_restarted_and_the_run_goes_on(tmp_path):
    made = scenario(duration_s=120.0, bag=tmp_path / "bag").with_parameters(
        "daq_bridge", command_timeout_s=15.0, follower_timeout_s=60.0
    )
    with Supervisor(made) as station:
        while station.observed.value("daq_bridge", "samples", 0) < 1:
            station.step()
        for victim in ("pressure_controller", "twin_simulator"):
            # a port there outlives its process, and whoever gets it next may hear nothing
            assert "fastrtps_port" not in Path(f"/proc/{station.process_id(victim)}/maps").read_text()
            os.kill(station.process_id(victim), signal.SIGKILL)
        station.wait(timeout_s=180.0)
        statistics = station.stop()
    assert statistics.restarts["pressure_controller"] == 1
    assert statistics.restarts["twin_simulator"] == 1
    assert statistics.bridge["samples"] == 6001
    assert 0 < statistics.bridge["missed_pressure"] < 5
    assert statistics.bridge["followers_lost"] == 0
    assert set(statistics.exit_status.values()) == {0}, statistics.exit_status
    with Bag(tmp_path / "bag") as bag:
        held = {each.removeprefix("/station/"): [m.sequence for m in bag.messages([each])] for each in bag.topics}
        losses = {each.removeprefix("/station/"): parse_loss(text) for each, text in bag.metadata[LOSS].items()}
    assert held["object/state"] == list(range(6001))
    # what the new processes say is in the bag from the first message on, and what the old ones could not say is counted
    for topic, gap in (("load/command", 5), ("twin/state", 60)):
        assert held[topic] == sorted(set(held[topic])), topic
        assert held[topic][-1] == 6000, topic
        assert losses[topic].received == len(held[topic]) >= 6001 - gap, topic
        assert losses[topic].lost == 6001 - len(held[topic]), topic
    for topic in ("load/setpoint", "position/setpoint", "position/command"):
        assert set(range(6001)) <= set(held[topic]), topic


def test_a_killed_bridge_ends_the_run_with_a_sentence():
    with Supervisor(scenario("realtime", 60.0)) as station:
        while station.observed.value("daq_bridge", "samples", 0) < 1:
            station.step()
        os.kill(station.process_id("daq_bridge"), signal.SIGKILL)
        with pytest.raises(RunError, match="daq_bridge"):
            station.wait(timeout_s=30.0)


def test_nothing_is_left_when_the_supervisor_is_killed():
    script = (
        "import sys; from dt_station_nodes.nodes.scenario import Scenario; "
        "from dt_station_nodes.nodes.supervisor import Supervisor\n"
        "with Supervisor(Scenario.load('paper').changed(duration_s=0.0)) as s:\n"
        "    while s.observed.value('daq_bridge', 'samples', 0) < 1: s.step()\n"
        "    print(*[s.process_id(n) for n in s.scenario.nodes], flush=True)\n"
        "    s.wait()\n"
    )
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    children = [int(word) for word in process.stdout.readline().split()]
    process.kill()
    process.wait()
    process.stdout.close()
    assert len(children) == 7
    end = time.monotonic() + 15.0
    while any(os.path.exists(f"/proc/{child}") for child in children):
        assert time.monotonic() < end
        time.sleep(0.01)
