"""The profile of Fast DDS: ours unless the user has one."""

import os
from xml.etree import ElementTree

import pytest

from dt_station_nodes.nodes.configuration import config_dir
from dt_station_nodes.nodes.dds_profile import use_profile

SPACE = {"d": "http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"}
NAMES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")


@pytest.fixture(autouse=True)
def clean(monkeypatch):
    for name in NAMES:
        # set and delete, so that what the test sets goes with it
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)


def test_ours_is_used_where_there_is_none():
    use_profile()
    assert {os.environ[name] for name in NAMES} == {str(config_dir() / "dds.xml")}


def test_that_of_the_user_stays(monkeypatch):
    monkeypatch.setenv(NAMES[1], "mine.xml")
    use_profile()
    assert os.environ[NAMES[1]] == "mine.xml"
    assert NAMES[0] not in os.environ


def test_without_a_configuration_there_is_none(monkeypatch, tmp_path):
    monkeypatch.setenv("DT_STATION_CONFIG", str(tmp_path))
    use_profile()
    assert not any(name in os.environ for name in NAMES)


def test_messages_come_through_sockets():
    """What a killed process leaves in shared memory can make the one started in its place deaf for good."""
    root = ElementTree.parse(config_dir() / "dds.xml").find(".//d:participant", SPACE)
    assert root.get("is_default_profile") == "true"
    kinds = [kind.tag for kind in root.findall("d:rtps/d:defaultUnicastLocatorList/d:locator/*", SPACE)]
    assert kinds == [f"{{{SPACE['d']}}}udpv4"]


def test_it_asks_readers_what_they_lack_many_times_a_second():
    period = ElementTree.parse(config_dir() / "dds.xml").find(".//d:data_writer/d:times/d:heartbeatPeriod", SPACE)
    assert int(period.findtext("d:sec", namespaces=SPACE)) == 0
    assert int(period.findtext("d:nanosec", namespaces=SPACE)) <= 100_000_000
