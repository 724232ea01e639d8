"""The doctor's loopback between two real processes."""

from dt_station_nodes.cli.dds_check import measure


def test_two_processes_hear_each_other():
    result = measure()
    assert result.healthy, result
    assert 0 < result.median_s <= result.p99_s < 1.0
