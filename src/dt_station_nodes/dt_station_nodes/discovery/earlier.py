"""What effects tell by the clock of a run, for one that began earlier than the stretch in which they were found."""

import math

from ..core.models import PathSpec
from .timing import PHASES, with_numbers

_TIMES = ("jump_s", "second_jump_s", "onset_s", "burst_start_s")  # of the run


def begun_earlier(path: PathSpec, earlier_s: float) -> PathSpec:
    """The path for a run that began `earlier_s` (s) before the one it was fitted to."""
    if earlier_s == 0.0:
        return path
    for effect in path.effects:
        numbers = effect.parameters
        phases = ((phase, hz) for name, phase, hz, _ in PHASES if name == effect.name and {phase, hz} <= set(numbers))
        turned = {p: math.remainder(numbers[p] - math.tau * numbers[hz] * earlier_s, math.tau) for p, hz in phases}
        # At 0 it was there from the start, and may have been before.
        put_off = {time: numbers[time] + earlier_s for time in _TIMES if numbers.get(time, 0.0) != 0.0}
        if numbers.get("burst_period_s", 0.0) > 0.0 and "burst_start_s" in put_off:
            put_off["burst_start_s"] %= numbers["burst_period_s"]
        path = with_numbers(path, effect, {**turned, **put_off})
    return path
