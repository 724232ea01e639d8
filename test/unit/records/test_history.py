"""A node's parameters over time, as a bag tells them."""

import pytest

from dt_station_nodes.records import RecordError
from dt_station_nodes.records.history import NodeHistory, ParameterChange


def test_changes_take_over_from_their_time_on():
    history = NodeHistory("twin", {"a": 1, "b": 2}, (ParameterChange(10, {"a": 5}),))
    assert history.at(9) == {"a": 1, "b": 2}
    assert history.at(10) == {"a": 5, "b": 2}


def test_a_parameter_that_the_bag_does_not_hold_is_named():
    values = NodeHistory("twin", {"a": 1}, ()).at(0)
    with pytest.raises(RecordError, match="parameter feed of twin"):
        values["feed"]
    assert values.get("feed") is None
