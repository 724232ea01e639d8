"""Other names of what a form does: no run tells them apart."""

from collections.abc import Mapping

from ..core.channels import Channel
from ..core.models import EffectSpec, PathSpec
from ..core.models.effects import Attachment, Quantity, registry

_SHARE = 0.05  # of a smooth loop, in one that counts as sharp,
_WHOLE = 0.1  # and how far several may be from letting all of the voltage through;
_GIVE = 0.4  # a linkage that gives lets so much pass beside its play
_LOOPS = ("hysteresis", "backlash")
_SMOOTH = ("closes_v", "bend_per_v")
_CORNERED = 4.0  # Bouc-Wen exponent from which a loop turns like a play operator
_SOFT = ("lag_s", "coast_s")
_BENT = 0.3  # knee from which a limit is met so softly that it is none within the run,
_BEYOND = 1.3  # times whose highest voltage it lies,
_GOES_ON = 0.2  # or beyond which so much goes on
_UNLIKE = 0.2  # of a lag: by so much more in one direction than on the mean of both it answers that one less
_WAYS = ("unequal", "closing")
_ABOVE = 0.2  # of the run's highest voltage: a kink that far up is where something may open
_CRACKING = 1.5  # times the rest pressure: what nothing leaks at is one that something opens at
_STAYS = 0.5  # of what comes on top of a relief valve's limit: where more is left, it may be a seal


def namesakes(
    path: PathSpec, added: tuple[str, ...], channel: Channel, scales: Mapping[Quantity, float]
) -> tuple[tuple[str, ...], ...]:
    """For each effect added to a path, names that stand for it as well; `scales` are the run's.

    A loop with sharp corners on a valve's voltage is what its linkage does, with play, and, of a pressure valve,
    what its spool does, held by dry friction. Play there whose contact gives or whose load coasts is a spool with
    mass that is held, and the other way round. What stops a position's reading alone, while the piston goes on, is
    its sensor's range. Several plays that all of a voltage goes through are a linkage of several joints, or a spool
    whose friction yields before it slides. A valve whose curve bends softly and meets no limit in the run is held
    by a spring that hardens. A pressure that lags more one way is one that fills quicker than it vents. One that
    answers less from some voltage on is one whose relief valve opens there and lets it rise on. A relief valve that
    leaves most of what comes on top is a seal that gives way. One past a piston, at a pressure well above that at rest,
    is a relief valve across its chambers.
    """
    peak = scales[Quantity.INPUT_PEAK]
    found = {effect.name: _names(effect, path, added, channel, peak) for effect in path.effects}
    return tuple(found.get(name, ()) for name in added)


def _names(
    effect: EffectSpec, path: PathSpec, added: tuple[str, ...], channel: Channel, peak_v: float
) -> tuple[str, ...]:
    if _only_bends(effect, peak_v) and "cubic_stiffness" not in added:
        return ("cubic_stiffness",)
    if channel is Channel.PRESSURE and _one_way(effect) and "asymmetric_gain" not in added:
        return ("asymmetric_gain",)
    if channel is Channel.PRESSURE and _eases(effect, peak_v) and "overflow" not in added:
        return ("overflow",)
    if channel is Channel.PRESSURE and _seeps(effect, path) and "leakage" not in added:
        return ("leakage",)
    if channel is Channel.POSITION and _cracks(effect) and "overflow" not in added:
        return ("overflow",)
    if channel is Channel.POSITION and effect.name == "overflow" and effect.at is Attachment.OUTPUT:
        return ("saturation",)
    if _swings(effect) and "backlash" not in added:
        return ("backlash",)
    if _joints(effect):
        return ("backlash", "friction") if channel is Channel.PRESSURE and "friction" not in added else ("backlash",)
    if effect.name not in _LOOPS or "friction" in added:
        return ()
    # A cylinder's friction is its piston's, which swallows motion.
    return tuple(name for name in _others(effect) if channel is Channel.PRESSURE or name != "friction")


def _others(effect: EffectSpec) -> tuple[str, ...]:
    if effect.name == "backlash" and effect.at is Attachment.INPUT:
        stiff = all(effect.parameters.get(name, 0.0) == 0.0 for name in _SOFT)
        return ("hysteresis", "friction") if stiff else ("friction",)
    return ("friction", "backlash") if sharp_loop(effect) else ()


def sharp_loop(effect: EffectSpec) -> bool:
    """Whether a loop has the corners of a play operator and little passes beside it."""
    return _plays(effect, _GIVE) and effect.parameters.get("spread", 0.0) < _SHARE


def _numbers(effect: EffectSpec, name: str) -> dict[str, float] | None:
    """All parameters of an effect of that name, else None."""
    return registry()[name].complete(effect.parameters) if effect.name == name else None


def _only_bends(effect: EffectSpec, peak_v: float) -> bool:
    """Whether a limit is none that the run meets: its curve bends softly all the way."""
    limit = _numbers(effect, "saturation")
    if limit is None or effect.place is not Attachment.INPUT:
        return False
    far = limit["upper_v"] - max(limit["centre_v"], 0.0) > _BEYOND * peak_v
    soft = limit["knee"] > _BENT or limit["straight"] < _SHARE
    return soft and (far or limit["passing"] > _GOES_ON)


def _one_way(effect: EffectSpec) -> bool:
    """Whether a lag is that of one direction more than of the other."""
    lag = _numbers(effect, "extra_lag")
    return lag is not None and any(abs(lag[way]) > _UNLIKE for way in _WAYS)


def _eases(effect: EffectSpec, peak_v: float) -> bool:
    """Whether a gain is less from a voltage on that is well above 0 V."""
    gain = _numbers(effect, "asymmetric_gain")
    return gain is not None and gain["asymmetry"] < 0.0 and gain["centre_v"] > _ABOVE * peak_v


def _seeps(effect: EffectSpec, path: PathSpec) -> bool:
    """Whether a relief valve leaves most of what comes on top of its limit."""
    valve = _numbers(effect, "overflow")
    if valve is None or path.denominator[-1] == 0.0:
        return False
    lag_s = path.time_scale * path.denominator[-2] / path.denominator[-1]
    left = valve["weir_s"] / (valve["weir_s"] + lag_s) if effect.place is Attachment.STATE else valve["override"]
    return left > _STAYS


def _cracks(effect: EffectSpec) -> bool:
    """Whether a leak begins at a pressure well above that at rest."""
    leak = _numbers(effect, "leakage")
    return leak is not None and leak["base"] > _CRACKING


def _swings(effect: EffectSpec) -> bool:
    """Whether dry friction holds a spool with mass."""
    spool = _numbers(effect, "friction")
    return spool is not None and spool["swing_s"] > 0.0


def _joints(effect: EffectSpec) -> bool:
    """Whether a loop is that of several play operators, and nothing passes beside it."""
    return _plays(effect, _WHOLE) and effect.parameters.get("spread", 0.0) >= _SHARE


def _plays(effect: EffectSpec, beside: float) -> bool:
    loop = _numbers(effect, "hysteresis")
    if loop is None:
        return False
    whole = abs(loop["steepness"] - 1.0) < _WHOLE and -beside <= loop["depth"] - 1.0 < _WHOLE
    cornered = loop["bouc_wen"] < _SHARE or loop["sharpness"] > _CORNERED
    return whole and cornered and all(loop[name] < _SHARE for name in _SMOOTH)
