"""Discovery on a measured hydraulic crane: its valve's static curve."""

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.discovery import Verdict, discover
from support.measured import free_run, model, names, table

pytestmark = [pytest.mark.measured, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def crane(measured_data):
    run = table(measured_data, "hydraulic_crane.mat", "crane_estimation")
    unseen = table(measured_data, "hydraulic_crane.mat", "crane_validation")
    return unseen, discover(run, model("crane"))


def test_crane_has_a_static_valve_curve(crane):
    _, result = crane
    assert result.verdict is Verdict.NAMED
    found = names(result, Channel.PRESSURE)
    assert found & {"dead_zone", "saturation", "asymmetric_gain"}
    assert "saturation" in found


def test_crane_on_the_second_half(crane):
    unseen, result = crane
    measured = unseen.signals["pressure_pa"]
    gap = measured - free_run(result.model, unseen, Channel.PRESSURE)
    assert 1.0 - np.linalg.norm(gap) / np.linalg.norm(measured - measured.mean()) >= 0.66
