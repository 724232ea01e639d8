"""Controller files: round trip, and one sentence for each mistake."""

from pathlib import Path

import pytest

from dt_station_nodes.core.control import ControlError, LoopConfig, LoopController
from dt_station_nodes.core.samples import ControlMode

CONTROLLERS = Path(__file__).resolve().parents[4] / "config" / "controllers"
PI = "mode: pi\npi: {gain: 1, integral_time_s: 1, error_scale: 1e-6}\n"


@pytest.mark.parametrize("path", sorted(CONTROLLERS.glob("*.yaml")), ids=lambda p: p.stem)
def test_shipped_controllers_load_run_and_round_trip(path) -> None:
    config = LoopConfig.from_yaml(path.read_text(encoding="utf-8"), path.name)
    assert config.name == path.stem
    assert LoopConfig.from_yaml(config.to_yaml()) == config
    LoopController(config, 0.02)


def test_numbers_as_people_write_them_are_numbers() -> None:
    assert LoopConfig.from_yaml(PI).pi.error_scale == 1e-6


def test_modes_on_offer_are_those_with_settings() -> None:
    assert LoopConfig.from_yaml(PI).modes() == (ControlMode.MANUAL, ControlMode.PI)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("mode: [", "not valid YAML at line"),
        ("- 1", "must be a mapping"),
        ("mode: turbo", "no mode is called turbo"),
        ("mode: pid", "no section pid"),
        (PI + "pies: 1", "pies"),
        (PI.replace("gain: 1", "gain: .nan"), "pi.gain"),
        (PI.replace("integral_time_s: 1", "integral_time_s: 0"), "pi.integral_time_s"),
        (PI + "limits: {lower_v: 3, upper_v: 1}", "lower_v must lie below upper_v"),
    ],
)
def test_mistakes_are_named_in_one_sentence(text, says) -> None:
    with pytest.raises(ControlError, match="^file.yaml") as caught:
        LoopConfig.from_yaml(text, "file.yaml")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_mode_without_settings_is_refused_live_too() -> None:
    with pytest.raises(ControlError, match="no section fuzzy"):
        LoopConfig.from_yaml(PI).with_mode(ControlMode.FUZZY)


@pytest.mark.parametrize("sample_time_s", [0.0, -1.0, float("nan")])
def test_sample_time_must_be_one(sample_time_s) -> None:
    with pytest.raises(ControlError, match="sample time"):
        LoopController(LoopConfig.from_yaml(PI), sample_time_s)
