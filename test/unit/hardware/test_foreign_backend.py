"""A backend from an installed package is opened by its name, like our own."""

import pytest

from dt_station_nodes.hardware import BackendError, open_backend

CODE = """
from dt_station_nodes.hardware import FakeBackend

def crane(options):
    assert options == {"sample_time_s": 0.02, "port": "/dev/ttyUSB0"}
    return FakeBackend(options["sample_time_s"])
"""


@pytest.fixture
def installed(tmp_path, monkeypatch):
    (tmp_path / "my_crane.py").write_text(CODE)
    about = tmp_path / "my_crane-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my-crane\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[dt_station.backends]\ncrane = my_crane:crane\n")
    monkeypatch.syspath_prepend(tmp_path)


@pytest.mark.usefixtures("installed")
def test_a_foreign_backend_opens_by_its_name():
    backend = open_backend("crane", {"sample_time_s": 0.02, "port": "/dev/ttyUSB0"})
    backend.open()
    assert backend.sample_time_s == 0.02
    backend.read()
    backend.close()


@pytest.mark.usefixtures("installed")
def test_a_foreign_backend_is_among_those_to_choose_from():
    with pytest.raises(BackendError, match="choose one of virtual, replay, fake, crane"):
        open_backend("magic", {})
