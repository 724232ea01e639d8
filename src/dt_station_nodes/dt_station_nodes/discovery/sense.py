"""Whether the effects of an explanation are what their names say, and not another at the end of its range."""

from collections.abc import Callable, Mapping

import numpy as np

from ..core.channels import Channel
from ..core.models import PathSpec
from ..core.models.effects import Attachment, Quantity, registry
from .laps import REACHED, laps
from .odds import creeps_uphill
from .problem import Problem
from .relieves import all_said, limits
from .selection import Explanation
from .terms import AWAY
from .timing import with_numbers

MOST_DAMPED = 0.42
RINGING = 0.25  # damping up to which a mode rings however little it carries;
LEAST_PEAK = 0.75  # one of more has to carry so much at its frequency, of what the path lets pass
TUNED, TUNED_RINGING = 1.25, 0.1  # times a frequency that drives the run: so near one it has to ring so long
FEWEST_TURNS = 1.5  # in a run, of what swells or by which two tones come apart: less is one tone that grows or fades
PART_OF_TURN = 0.4  # the same of a frequency that swings
LEAST_BURST = 1.0  # cycles that a burst has: less is a push at times of its own, which has no period
LEAST_CUBE = 0.3  # of a spring's force at the end of its travel, beside the linear part
LEAST_LOOP = 0.05  # of what a loop leaves, more with it shut: less and it is a curve
WIDEST_LOOP = 0.95  # of the voltage,
MOST_CAUGHT = 0.7  # where so much of it has to go through the loop
MOST_DEPTH = 1.15  # share of the voltage through a loop: more turns back against it, as a textbook's may
FAR_CENTRE = 0.2  # of the run's range: further beyond it is no middle of a spring
QUICK_HEAT = 1.02  # times the quickest
HIGHEST_BASE = 1.9  # of the rest pressure
NO_LEAK = 0.01  # of the run's speed per load: so little beside what sags is none
MOST_UNEVEN = 0.79  # of a loop's two ways: the end of its range
LARGEST_MODE = 2.9  # beside a path, over that: the voltage of a closed loop shows what its output does
QUICKEST_MODE = 0.39  # of the sampling frequency
MOST_ASYMMETRIC = 0.8  # gain of the weaker side a ninth of the stronger's
MOST_KINKED = 0.54  # the same away from 0 V: what passes less than 0.3 beyond its kink is a limit
BLUNTEST_KINK = 0.3  # of the voltage, over which it is rounded: more is a curve that bends all along
LEAST_PLAY = 0.1  # times the way gone in the time in which it closes
QUICKEST_CREEP = 0.5  # of the run's speed
QUICKEST_SWING = 0.08  # of a sample, one over its natural frequency: a quicker one shows no overshoot
LEAST_SLIP = 0.2  # of what a spool takes to break away,
LEAST_BENT = 0.1  # or of it as a way: bristles that bend over less are so stiff that it is play
MOST_BENT = 0.08  # of the run's range: what bends over more hardly ever slides, it is a loop of what else bends


def _regular(path: PathSpec, problem: Problem) -> bool:
    """Whether an oscillation's second tone is another one, and its swelling comes again within the run.

    One that comes and goes oscillates while it is there. One whose frequency swings is a machine whose speed does; a
    part of such a swing in the run shows it.
    """
    wave = path.effect("periodic_disturbance").parameters
    on_s = wave["burst_share"] * wave["burst_period_s"]
    if on_s > 0.0 and wave["push_share"] == 0.0 and on_s * wave["frequency_hz"] < LEAST_BURST:
        return False
    apart_hz = abs(wave["second_hz"] - wave["frequency_hz"]) if wave["second_share"] != 0.0 else np.inf
    swell_hz = wave["swell_hz"] if wave["swell"] != 0.0 else np.inf
    if wave.get("modulation_rad", 0.0) != 0.0:
        return min(swell_hz, wave["modulation_hz"]) * problem.length_s >= PART_OF_TURN
    return min(apart_hz, swell_hz) * problem.length_s >= FEWEST_TURNS


def _passes(path: PathSpec, problem: Problem) -> bool:
    """Whether the voltage gets through a loop, or past it: one as wide as all of it lets nothing pass.

    What goes back where the voltage goes on is a loop only where it leaves nothing else to be said. What takes nine
    times as long to turn one way as the other is none, nor is what bends as well with none.
    """
    spec = path.effect("hysteresis")
    loop = spec.parameters
    if abs(loop["uneven"]) >= MOST_UNEVEN or (loop["depth"] > MOST_DEPTH and not all_said(path, problem)):
        return False
    if loop["bend_per_v"] > 0.0:
        shut = with_numbers(path, spec, {"half_width_v": 0.0})
        without, left = (float(np.sum(np.square(problem.residual(one)))) for one in (shut, path))
        if without < (1.0 + LEAST_LOOP) * left:
            return False
    return loop["depth"] < MOST_CAUGHT or loop["half_width_v"] < WIDEST_LOOP * problem.scales[Quantity.INPUT]


def _leaves_room(path: PathSpec, _problem: Problem) -> bool:
    """Whether voltages lie between a limit's two ends: none do where the upper one is the lower."""
    limit = path.effect("saturation").parameters
    return limit["lower_v"] < limit["upper_v"]


def _rings(path: PathSpec, problem: Problem) -> bool:
    """Whether a mode rings: a damped one is a lag under another name, one too quick is what the samples leave out.

    One that rings and carries little only moves the path's own poles, or turns what drives it as anything does; one far
    larger than the path is read from a voltage that answers the output, unless it leaves nothing else to be said.
    """
    mode = path.effect("resonance").parameters
    damping, turn = mode["damping"], mode["frequency_hz"] * problem.simulator.sample_time_s
    heard = damping <= RINGING or float(np.hypot(mode["share"], mode["riding"])) >= LEAST_PEAK * 2.0 * damping
    if any(1.0 / TUNED < mode["frequency_hz"] / hz < TUNED for hz in problem.excitations_hz):
        carried = float(np.hypot(mode["beside"], mode["beside_rate"]) or np.hypot(mode["share"], mode["riding"]))
        heard = damping <= TUNED_RINGING or carried >= LEAST_PEAK * 2.0 * damping
    if not (heard and damping <= MOST_DAMPED and turn < QUICKEST_MODE):
        return False
    return max(abs(mode["beside"]), abs(mode["beside_rate"])) <= LARGEST_MODE or all_said(path, problem)


def _two_sided(path: PathSpec, problem: Problem) -> bool:
    """Whether an asymmetric gain passes something on either side of a kink that the run goes through.

    One that passes next to nothing on a side is a limit. Where its kink is no kink it is a curve, which limits and
    losses of pressure bend.
    """
    gain = path.effect("asymmetric_gain").parameters
    if gain["centre_v"] == 0.0:
        return abs(gain["asymmetry"]) <= MOST_ASYMMETRIC
    if gain["rounding_v"] > BLUNTEST_KINK * problem.scales[Quantity.INPUT]:
        return False
    below = float(np.mean(problem.simulator.voltage_v < gain["centre_v"]))
    return abs(gain["asymmetry"]) <= MOST_KINKED and min(below, 1.0 - below) >= REACHED


def _hardens(path: PathSpec, problem: Problem) -> bool:
    """Whether a spring's cube is felt where the run goes: a linear one is what leaks back, or a pole off zero.

    A pressure's about one that the run never comes near is a curve that bends one way, and one with play that the run
    takes up on one side alone opens above a level, as a valve does. What drives a piston away from its centre is none.
    """
    spring = path.effect("cubic_stiffness").parameters
    above, beside = problem.measured - path.rest - spring["centre"], FAR_CENTRE * float(np.ptp(problem.measured))
    near = above.min() - beside <= 0.0 <= above.max() + beside
    sides = min(np.mean(above < -spring["play"]), np.mean(above > spring["play"])) if spring["play"] > 0.0 else 1.0
    if problem.channel is Channel.PRESSURE and (sides < REACHED or not near):
        return False
    pulls = spring["linear"] > -spring["coefficient"] * float(np.max(np.square(above)))
    if problem.windows.anchored and spring["coefficient"] < 0.0 and not pulls:
        return False
    travel_squared = problem.scales[Quantity.INPUT_PER_OUTPUT] / problem.scales[Quantity.INPUT_PER_OUTPUT_CUBED]
    bent = float(np.mean(problem.measured)) - path.rest - spring["centre"]
    return abs(spring["coefficient"]) * max(travel_squared, bent**2) > LEAST_CUBE * abs(spring["linear"])


def _loses(path: PathSpec, problem: Problem) -> bool:
    """Whether a leak lets the pressure fall, slows a piston or lets it creep the way its load pushes it.

    What lets a pressure rise up to twice where it rests is no leak. One from the supply past a valve's land pushes a
    piston either way: it is believed where it leaves nothing.
    """
    leak = path.effect("leakage").parameters
    if problem.channel is Channel.PRESSURE and leak["base"] > HIGHEST_BASE:
        return False
    if problem.channel is Channel.PRESSURE or leak["against"] > 0.5:
        sags = leak["sag_per_s"] != 0.0
        least = -NO_LEAK * problem.scales[Quantity.VELOCITY_PER_LOAD] if sags else 0.0
        return leak["coefficient"] > least
    if leak["sag_per_s"] != 0.0 or not creeps_uphill(path):
        return True
    return all_said(path, problem)


def _plays(path: PathSpec, problem: Problem) -> bool:
    """Whether play does more than the time that it takes to close: else it is a lag under another name.

    On a voltage that goes through a loop besides, it is a part of that loop.
    """
    play = path.effect("backlash")
    if play.at is Attachment.INPUT:
        looped = any(effect.name == "hysteresis" for effect in path.effects)
        return play.parameters["half_width"] > 0.0 and not looped
    closing = play.parameters["lag_s"] * problem.scales[Quantity.VELOCITY]
    return play.parameters["half_width"] > LEAST_PLAY * closing


def _warms(path: PathSpec, problem: Problem) -> bool:
    """Whether what heats takes its time: at the quickest that it may be, it is a memory of what was put in."""
    quickest = registry()["gain_drift"].parameter("heat_s").lower * problem.scales[Quantity.RUN_TIME]
    return not 0.0 < path.effect("gain_drift").parameters.get("heat_s", 0.0) < QUICK_HEAT * quickest


def _slips(path: PathSpec, problem: Problem) -> bool:
    """Whether a spool that breaks away slips a part of the way: one that does not is a play operator, a loop.

    One that creeps is a lag where the run seldom moves it faster; bristles so stiff that they hardly bend make it play,
    unless they break away, and so does a mass that swings quicker than samples show.
    """
    spool = path.effect("friction").parameters
    if problem.channel is not Channel.PRESSURE:
        return True
    if spool["swing_s"] > 0.0:
        return spool["swing_s"] > QUICKEST_SWING * problem.simulator.sample_time_s
    if spool["presliding"] > 0.0:
        stiff = spool["presliding"] * problem.scales[Quantity.INPUT_PER_OUTPUT] <= LEAST_BENT * spool["coulomb_v"]
        breaks = spool["static_excess_v"] > LEAST_SLIP * (spool["coulomb_v"] + spool["static_excess_v"])
        return (breaks or not stiff) and spool["presliding"] < MOST_BENT * problem.scales[Quantity.OUTPUT]
    if spool["creep_velocity"] > 0.0:
        return spool["creep_velocity"] < QUICKEST_CREEP * problem.scales[Quantity.VELOCITY]
    return spool["slip"] > LEAST_SLIP


def _trails(path: PathSpec, _problem: Problem) -> bool:
    """Whether a lag does not ring: one that does is a mode under another name.

    Beside a second stage slower than its swing it peaks no more, however little it is damped, unless it rings anyhow.
    """
    lag = path.effect("extra_lag").parameters
    swing = lag["time_constant_s"] * lag["inertia_s"]
    hidden = 1.0 + lag["second_s"] ** 2 / swing if swing > 0.0 else 1.0
    most = min(hidden / (2.0 * MOST_DAMPED) ** 2, 1.0 / (2.0 * RINGING) ** 2)
    return lag["inertia_s"] <= most * lag["time_constant_s"]


_CHECKS: Mapping[str, Callable[[PathSpec, Problem], bool]] = {
    "asymmetric_gain": _two_sided,
    "backlash": _plays,
    "cubic_stiffness": _hardens,
    "dead_zone": laps,
    "extra_lag": _trails,
    "friction": _slips,
    "gain_drift": _warms,
    "hysteresis": _passes,
    "leakage": _loses,
    "overflow": limits,
    "periodic_disturbance": _regular,
    "resonance": _rings,
    "saturation": _leaves_room,
}


def sensible(explanation: Explanation, problem: Problem) -> bool:
    """Whether each effect is what its name says, and not another one at the end of its range."""
    if any(_at_bound(explanation, index, problem) for index in range(len(explanation.fit.hypothesis.terms))):
        return False
    path = explanation.fit.path
    return all(_CHECKS[name](path, problem) for name in explanation.added if name in _CHECKS)


def _at_bound(explanation: Explanation, index: int, problem: Problem) -> bool:
    """Whether a nominal parameter is as far off as it may be: the effect named then does not explain the run."""
    term = explanation.fit.hypothesis.terms[index]
    if term.effect >= 0 or not term.prior or explanation.held:
        return False
    if term.name.startswith(AWAY) and problem.standing_load:
        # A load that stands is a bias under another name, whose size says nothing of the load.
        return False
    low, high = term.bounds
    x = float(explanation.fit.fitted.x[index])
    return min(x - low, high - x) < 1e-6 * (high - low)
