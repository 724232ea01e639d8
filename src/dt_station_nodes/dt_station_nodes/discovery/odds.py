"""What speaks against the places and forms of effects before any run does."""

from ..core.channels import Channel
from ..core.models import PathSpec
from ..core.models.effects import registry
from .namesakes import sharp_loop

# Twice the log prior odds against forms that are rarely what a name means.
UNUSUAL = {
    ("backlash", "input"): 4.0,
    # A gauge's linkage has less play than a valve's.
    ("backlash", "pressure"): 6.0,
    ("overflow", "output"): 1.0,
    # Without voltages inside its band a dead zone only takes off a constant; a bias could as well add one.
    ("bias", "pressure"): 4.0,
    # A sensor's zero shifts more seldom than a valve's null.
    ("bias", "output"): 6.0,
    # A pressure valve's loop is its magnet's more often than its spool's.
    ("friction", "pressure"): 6.0,
    ("cross_coupling", "position"): 8.0,
    # A piston's drag grows with its speed's square where oil is thin and quick: a valve's limits are commoner.
    ("quadratic_damping", "position"): 6.0,
    ("overflow", "pressure"): 4.0,
    # What limits a pressure from behind is a relief valve more often than a supply.
    ("saturation", "output"): 8.0,
    # A sensor that lags, waits or rings is rarer than a valve that does.
    ("delay", "output"): 3.0,
    ("extra_lag", "output"): 3.0,
    ("resonance", "output"): 3.0,
    # A supply or a coil drifts more than a sensor.
    ("gain_drift", "output"): 3.0,
    # Friction is the commoner of what swallows motion rather than voltage.
    ("dead_zone", "state"): 10.0,
    # A leak, a spring or a load of a pressure valve bends its curve as its limits and overlap do, which are commoner.
    ("leakage", "pressure"): 5.0,
    ("load_dependent_gain", "pressure"): 6.0,
    ("cubic_stiffness", "pressure"): 12.0,
    ("cubic_stiffness", "output"): 12.0,
    ("leakage", "output"): 12.0,
    # A search over hundreds of frequencies finds one in any noise.
    ("periodic_disturbance", "position"): 13.0,
    ("periodic_disturbance", "pressure"): 13.0,
    ("periodic_disturbance", "input"): 13.0,
}

# The same against refinements: a rim is sharp, what bends softly is a valve; cross-talk comes at once or lags, and
# stays; what comes late in two portions lags more often than its line throws it back.
UNUSUAL_FORMS = {
    ("overflow", "rounding"): 3.0,
    ("cross_coupling", "at_once"): 8.0,
    ("cross_coupling", "changes"): 8.0,
    ("delay", "echo"): 4.0,
    # A limit of its own is commoner than one of the loop alone.
    ("hysteresis", "bend_per_v"): 8.0,
}
# The same against a loop with the corners of a play operator: what magnets do is round.
SHARP_LOOP = 6.0
# The same against a leak that lets a piston creep against its load, as one from the supply past a valve's land.
UPHILL = 8.0
# The same against one that takes its time to move a piston: what does is a null that warms.
LATE = 4.0


def against(path: PathSpec, channel: Channel) -> float:
    """Twice the log prior odds against the places and forms of a path's effects."""
    found = UPHILL * creeps_uphill(path) + LATE * _creeps_late(path)
    for effect in path.effects:
        found += SHARP_LOOP * sharp_loop(effect)
        found += UNUSUAL.get((effect.name, effect.at.value if effect.at else channel.value), 0.0)
        for (name, parameter), odds in UNUSUAL_FORMS.items():
            neutral = registry()[name].parameter(parameter).neutral
            found += odds * (effect.name == name and effect.parameters[parameter] != neutral)
    return found


def _leaks(path: PathSpec) -> list[dict[str, float]]:
    return [effect.parameters for effect in path.effects if effect.name == "leakage"]


def _creeps_late(path: PathSpec) -> bool:
    return path.denominator[-1] == 0.0 and any(leak["lag_s"] > 0.0 for leak in _leaks(path))


def creeps_uphill(path: PathSpec) -> bool:
    """Whether a leak lets a piston creep against what its load does to it."""
    if path.disturbance is None:
        return False
    pushes = path.disturbance.gain * path.disturbance.numerator[-1]
    return any(leak["against"] <= 0.5 and leak["coefficient"] * pushes > 0.0 for leak in _leaks(path))
