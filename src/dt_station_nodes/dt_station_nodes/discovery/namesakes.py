"""Other names of what a form does: no run tells them apart."""

from ..core.channels import Channel
from ..core.models import EffectSpec, PathSpec
from ..core.models.effects import Attachment, registry

_SHARE = 0.05  # of a smooth loop, in one that counts as sharp,
_WHOLE = 0.1  # and how far several may be from letting all of the voltage through;
_GIVE = 0.4  # a linkage that gives lets so much pass beside its play
_LOOPS = ("hysteresis", "backlash")
_SMOOTH = ("closes_v", "bend_per_v")
_CORNERED = 4.0  # Bouc-Wen exponent from which a loop turns like a play operator
_SOFT = ("lag_s", "spread", "coast_s")


def namesakes(path: PathSpec, added: tuple[str, ...], channel: Channel) -> tuple[tuple[str, ...], ...]:
    """For each effect added to a path, names that stand for it as well.

    A loop with sharp corners on a valve's voltage is what its linkage does, with play, and, of a pressure valve, what
    its spool does, held by dry friction. Play there whose contact gives or whose load coasts is a spool with mass that
    is held. What stops a position's reading alone, while the piston goes on, is its sensor's range. Several plays that
    all of a voltage goes through are a linkage of several joints, or a spool whose friction yields before it slides.
    """
    found = {effect.name: _names(effect, added, channel) for effect in path.effects}
    return tuple(found.get(name, ()) for name in added)


def _names(effect: EffectSpec, added: tuple[str, ...], channel: Channel) -> tuple[str, ...]:
    if channel is Channel.POSITION and effect.name == "overflow" and effect.at is Attachment.OUTPUT:
        return ("saturation",)
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


def _joints(effect: EffectSpec) -> bool:
    """Whether a loop is that of several play operators, and nothing passes beside it."""
    return _plays(effect, _WHOLE) and effect.parameters.get("spread", 0.0) >= _SHARE


def _plays(effect: EffectSpec, beside: float) -> bool:
    entry = registry()["hysteresis"]
    if effect.name != entry.name:
        return False
    loop = entry.complete(effect.parameters)
    whole = abs(loop["steepness"] - 1.0) < _WHOLE and -beside <= loop["depth"] - 1.0 < _WHOLE
    cornered = loop["bouc_wen"] < _SHARE or loop["sharpness"] > _CORNERED
    return whole and cornered and all(loop[name] < _SHARE for name in _SMOOTH)
