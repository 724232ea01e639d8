"""How sure a name is."""

from types import SimpleNamespace
from typing import cast

import pytest

from dt_station_nodes.discovery.channel import Finding
from dt_station_nodes.discovery.verdict import confidence


def finding(margin: float) -> Finding:
    """A finding that explains all of a gap and leads by `margin`."""
    sure = SimpleNamespace(margin=margin, gain=1e3, excess=0.0, interrupted=False, best=None, ranking=(), scores=())
    return cast("Finding", sure)


@pytest.mark.parametrize("margin", [6.0, 40.0, 4000.0])
def test_a_name_that_another_may_stand_for_is_no_surer_for_its_lead(margin: float) -> None:
    assert confidence(finding(margin), ("saturation",)) == confidence(finding(6.0), ("saturation",)) < 0.6
    assert confidence(finding(margin), ()) > 0.99
