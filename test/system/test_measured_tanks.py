"""Discovery on measured cascaded tanks: the upper one overflows."""

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.discovery import Verdict, discover
from support.measured import free_run, model, names, table

pytestmark = [pytest.mark.measured, pytest.mark.timeout(900)]


@pytest.fixture(scope="module")
def tanks(measured_data):
    run = table(measured_data, "cascaded_tanks.csv", "tanks")
    unseen = table(measured_data, "cascaded_tanks.csv", "tanks_validation")
    return unseen, discover(run, model("tanks"))


def test_tanks_overflow(tanks):
    unseen, result = tanks
    assert result.verdict is Verdict.NAMED
    assert "overflow" in names(result, Channel.POSITION)
    gap = unseen.signals["position_m"] - free_run(result.model, unseen, Channel.POSITION)
    assert np.sqrt(np.mean(np.square(gap))) <= 0.35
