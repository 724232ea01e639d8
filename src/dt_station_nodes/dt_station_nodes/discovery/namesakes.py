"""Other names of what a form does: no run tells them apart."""

from ..core.channels import Channel
from ..core.models import PathSpec
from ..core.models.effects import registry

_SHARE = 0.05  # of a smooth loop, in one that counts as sharp,
_WHOLE = 0.1  # and how far it may be from letting all of the voltage through
_LIKE_A_LOOP = ("friction", "backlash")
_SMOOTH = ("spread", "bouc_wen", "closes_v", "bend_per_v")


def namesakes(path: PathSpec, added: tuple[str, ...], channel: Channel) -> tuple[tuple[str, ...], ...]:
    """For each effect added to a path, names that stand for it as well.

    A loop with sharp corners on the voltage of a pressure valve is what its spool does, held by dry friction, and what
    its linkage does, with play.
    """
    sharp = channel is Channel.PRESSURE and "friction" not in added
    return tuple(_LIKE_A_LOOP if sharp and name == "hysteresis" and _sharp(path) else () for name in added)


def _sharp(path: PathSpec) -> bool:
    effect = registry()["hysteresis"]
    loop = effect.complete(path.effect("hysteresis").parameters)
    whole = all(abs(loop[name] - effect.parameter(name).neutral) < _WHOLE for name in ("depth", "steepness"))
    return whole and all(loop[name] < _SHARE for name in _SMOOTH)
