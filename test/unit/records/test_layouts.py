"""Plot layouts name topics and fields that exist."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from dt_station_nodes.records.definitions import fields, installed_definition, typestore

LAYOUTS = Path(__file__).parents[3] / "config" / "layouts"
PACKAGE = "dt_station_msgs/msg/"
TYPES = {
    "object/state": "PlantState",
    "twin/state": "PlantState",
    "load/setpoint": "Setpoint",
    "position/setpoint": "Setpoint",
    "shadow/residual": "Residual",
}


def foxglove() -> set[tuple[str, str]]:
    panels = json.loads((LAYOUTS / "foxglove.json").read_text())["configById"]
    values = [path["value"] for panel in panels.values() for path in panel.get("paths", ())]
    return {(value.split(".")[0], value.split(".")[1]) for value in values}


def plotjuggler() -> set[tuple[str, str]]:
    curves = ElementTree.parse(LAYOUTS / "plotjuggler.xml").getroot().iter("curve")
    return {tuple(curve.attrib["name"].rsplit("/", 1)) for curve in curves}  # type: ignore[misc]


@pytest.mark.parametrize("read", [foxglove, plotjuggler])
def test_every_curve_is_a_field_of_a_station_topic(read) -> None:
    curves = read()
    assert len(curves) >= 10
    for topic, field in curves:
        kind = PACKAGE + TYPES[re.sub("^/station/", "", topic)]
        known = [name for name, _ in fields(typestore({kind: installed_definition(kind)}), kind)]
        assert field in known, (topic, field)
