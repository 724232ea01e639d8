"""What the doctor says of a healthy and of a sick installation."""

import json

import pytest

from dt_station_nodes.cli import app, doctor
from dt_station_nodes.cli.dds_check import Loopback

HEALTHY = Loopback(sent=200, returned=200, discovery_s=0.2, median_s=3e-4, p99_s=2e-3)


@pytest.fixture
def heard(monkeypatch):
    loopback = doctor.loopback

    def set_loopback(result):
        measured = loopback(lambda: result)
        monkeypatch.setattr(doctor, "loopback", lambda: measured)

    set_loopback(HEALTHY)
    monkeypatch.setattr(doctor, "built", lambda: iter([doctor.Finding("messages", "7")]))
    return set_loopback


def test_a_healthy_installation_is_ok(heard, capsys):
    assert app.main(["doctor", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["ok"] is True
    assert told["dds"]["returned"] == 200
    assert set(told["versions"]) == set(doctor.LIBRARIES)
    assert all(finding["advice"] == "" for finding in told["findings"] if finding["ok"])


@pytest.mark.parametrize(
    "result",
    [
        Loopback(200, 0, 15.0, 0.0, 0.0, "no second process was discovered"),
        Loopback(200, 180, 0.2, 3e-4, 2e-3),
    ],
    ids=["deaf", "lossy"],
)
def test_a_deaf_or_lossy_middleware_is_not_ok_and_has_advice(heard, capsys, result):
    heard(result)
    assert app.main(["doctor", "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    sick = [finding for finding in told["findings"] if not finding["ok"]]
    assert [finding["name"] for finding in sick] == ["two processes"]
    assert "ROS_DOMAIN_ID" in sick[0]["advice"]


def test_people_get_a_table(heard, capsys):
    assert app.main(["doctor"]) == 0
    assert "two processes" in capsys.readouterr().out


def test_stage_seconds_come_from_the_stamps(tmp_path, monkeypatch):
    monkeypatch.setenv("DT_STATION_WORLD", str(tmp_path))
    (tmp_path / "stamps").mkdir()
    (tmp_path / "stamps" / "venv").write_text('{"key": "k", "seconds": 1.5}')
    (tmp_path / "stamps" / ".venv.77").write_text("half")
    assert doctor.stages() == {"venv": 1.5}
