"""A model of few poles is first taken as it is known, and as a rough fit of foreign data only where that fails."""

from types import SimpleNamespace

import numpy as np
import pytest

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PathSpec, PlantModel
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings, Verdict, discover, inspection
from dt_station_nodes.discovery.data_checks import check_run
from dt_station_nodes.workers import ALONE

PATH = PathSpec(numerator=[960.0], denominator=[1.0, 56.0, 1600.0], scale=1e6, rest=2e6)
VALVE = ModelSpec(name="valve", paths={Channel.PRESSURE: PATH})
STEP_S = 0.01


def driven(path: PathSpec) -> Run:
    """A path under steps of a seeded size, with 40 dB of noise."""
    rng = np.random.default_rng(5)
    volts = np.repeat(rng.uniform(-3.0, 3.0, 60), 20)
    plant = PlantModel(ModelSpec(name="rig", paths={Channel.PRESSURE: path}), STEP_S)
    pressure = plant.simulate(volts, np.zeros(len(volts)), state=plant.initial_state()).pressure_pa
    noise = 0.01 * np.std(pressure) * rng.standard_normal(len(volts))
    return Run(STEP_S, {"load_voltage_v": volts, "pressure_pa": pressure + noise})


def test_a_constant_is_the_valves_and_no_other_rest_of_the_model() -> None:
    biased = VALVE.with_effect(Channel.PRESSURE, "bias", {"bias_v": 0.3}).paths[Channel.PRESSURE]
    result = discover(driven(biased), VALVE)
    assert [effect.name for effect in result.effects] == ["bias"]
    assert result.effects[0].parameters["bias_v"].value == pytest.approx(0.3, rel=0.1)


def test_a_damping_that_is_off_is_no_effect() -> None:
    """Neither gain nor time scale can mend it: it is free itself."""
    damped = PATH.model_copy(update={"denominator": (1.0, 36.0, 1600.0)})
    result = discover(driven(damped), VALVE)
    assert result.verdict is Verdict.PARAMETERS_ONLY
    assert result.gap.after[Channel.PRESSURE].rms < 1.1 * result.gap.noise_floor[Channel.PRESSURE].rms


def test_what_the_known_model_explains_is_not_looked_at_again(monkeypatch: pytest.MonkeyPatch) -> None:
    looks: list[bool] = []
    examine = inspection.examine

    def counted(problem, *rest):
        looks.append(problem.rough)
        return examine(problem, *rest)

    monkeypatch.setattr(inspection, "examine", counted)
    settings = DiscoverySettings()
    run = driven(PATH.model_copy(update={"gain": 1.05}))
    (check,) = check_run(run)
    finding, notes = inspection.examine_channel(run, None, VALVE, check, settings, None, ALONE)
    assert finding.verdict is Verdict.PARAMETERS_ONLY
    assert (looks, notes) == ([False], [])


@pytest.mark.parametrize(("verdict", "asked"), [(Verdict.UNEXPLAINED, [False, True]), (Verdict.NAMED, [False])])
def test_the_other_run_is_asked_in_the_place_of_one_with_bent_parameters_only_where_that_tells_nothing(
    monkeypatch: pytest.MonkeyPatch, verdict: Verdict, asked: list[bool]
) -> None:
    bent: list[bool] = []
    examined = SimpleNamespace(verdict=verdict, interrupted=False)

    def nothing(*_: object, **also: bool) -> tuple[None, str]:
        bent.append(also.get("bent", False))
        return None, ""

    monkeypatch.setattr(inspection, "found_only_there", nothing)
    monkeypatch.setattr(inspection, "examine", lambda *_: examined)
    for later in ("found_there", "found_adrift"):
        monkeypatch.setattr(inspection, later, lambda finding, *_: (finding, ""))
    for last in ("polished", "_with_commands_lost"):
        monkeypatch.setattr(inspection, last, lambda finding, *_: finding)
    monkeypatch.setattr(inspection, "refits_all", lambda _: False)
    run = driven(PATH)
    (check,) = check_run(run)
    finding, notes = inspection.examine_channel(run, run, VALVE, check, DiscoverySettings(), None, ALONE)
    assert finding is examined
    assert (bent, notes) == (asked, [])
