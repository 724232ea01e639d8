"""What effects tell by the clock of a run, for one that began earlier than the stretch in which they were found."""

import math

from ..core.models import EffectSpec, PathSpec

# Phases at the start of the run, and frequencies (Hz) they turn with; times of the run.
_PHASES = {
    "phase_rad": "frequency_hz",
    "second_rad": "second_hz",
    "swell_rad": "swell_hz",
    "modulation_phase_rad": "modulation_hz",
    "wander_rad": "wander_hz",
}
_TIMES = ("jump_s", "second_jump_s", "onset_s", "burst_start_s")


def begun_earlier(path: PathSpec, earlier_s: float) -> PathSpec:
    """The path for a run that began `earlier_s` (s) before the one it was fitted to."""
    if earlier_s == 0.0:
        return path
    return path.model_copy(update={"effects": tuple(_begun_earlier(effect, earlier_s) for effect in path.effects)})


def _begun_earlier(effect: EffectSpec, earlier_s: float) -> EffectSpec:
    numbers = effect.parameters
    turned = {
        phase: math.remainder(numbers[phase] - math.tau * numbers[frequency] * earlier_s, math.tau)
        for phase, frequency in _PHASES.items()
        if phase in numbers and frequency in numbers
    }
    # At 0 it was there from the start, and may have been before.
    put_off = {time: numbers[time] + earlier_s for time in _TIMES if numbers.get(time, 0.0) != 0.0}
    if "burst_start_s" in put_off and numbers["burst_period_s"] > 0.0:
        put_off["burst_start_s"] %= numbers["burst_period_s"]
    return effect.model_copy(update={"parameters": {**numbers, **turned, **put_off}})
