"""Backends by name, so that a parameter file chooses the object."""

from collections.abc import Callable, Mapping
from importlib.metadata import entry_points
from typing import Any

from ..core.errors import StationError
from ..core.run import Run
from .backend import Backend
from .fake import FakeBackend
from .replay import ReplayBackend

ENTRY_POINT_GROUP = "dt_station.backends"
"""Where an installed package offers an object of its own: a function from the options to a Backend."""


class BackendError(StationError):
    """A backend that cannot be had; one sentence that says what to do."""


def open_backend(kind: str, options: Mapping[str, Any]) -> Backend:
    """The backend of a kind, not yet open.

    virtual: `sample_time_s`, `rig` (name or path of a rig file, or a RigConfig), `seed` (instead of the file's);
    replay: `run` (a Run; `sample_time_s`, if given, must be the run's); fake: `sample_time_s`, `samples` (optional);
    any other: what an installed package offers under that name in the entry point group `dt_station.backends`.
    Raises BackendError or RigError, or what a foreign backend raises.
    """
    if kind not in _KINDS:
        foreign = {point.name: point for point in entry_points(group=ENTRY_POINT_GROUP)}
        if kind in foreign:
            backend: Backend = foreign[kind].load()(dict(options))
            return backend
        raise BackendError(f"no backend is called {kind!r}; choose one of {', '.join([*_KINDS, *sorted(foreign)])}")
    make, known = _KINDS[kind]
    unknown = sorted(set(options) - known)
    if unknown:
        raise BackendError(f"backend {kind} has no option {unknown[0]!r}; it takes {', '.join(sorted(known))}")
    return make(dict(options))


def _sample_time(options: Mapping[str, Any], kind: str) -> float:
    try:
        return float(options["sample_time_s"])
    except (KeyError, TypeError, ValueError):
        raise BackendError(f"backend {kind} needs sample_time_s, a number of seconds") from None


def _virtual(options: Mapping[str, Any]) -> Backend:
    # Only here: numba takes half a second to import, and replay does without it.
    from .virtual import RigConfig, VirtualBackend, VirtualRig, load_rig  # noqa: PLC0415

    rig = options.get("rig")
    if rig is None:
        raise BackendError("backend virtual needs rig, the name or path of a rig file, such as paper")
    config = rig if isinstance(rig, RigConfig) else load_rig(rig)
    if options.get("seed") is not None:
        seed = options["seed"]
        if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 2**53:
            raise BackendError(f"backend virtual needs a whole number from 0 as seed, not {seed!r}")
        config = config.model_copy(update={"seed": seed})
    return VirtualBackend(VirtualRig(config, _sample_time(options, "virtual")))


def _replay(options: Mapping[str, Any]) -> Backend:
    run = options.get("run")
    if not isinstance(run, Run):
        raise BackendError("backend replay needs run, the measured data read from a file")
    asked = options.get("sample_time_s")
    if asked is not None and abs(float(asked) - run.sample_time_s) > 1e-6 * run.sample_time_s:
        raise BackendError(
            f"{run.source or 'the run'} is sampled every {run.sample_time_s:g} s, not {asked:g} s; set sample_time_s so"
        )
    return ReplayBackend(run)


def _fake(options: Mapping[str, Any]) -> Backend:
    return FakeBackend(_sample_time(options, "fake"), options.get("samples"))


_KINDS: Mapping[str, tuple[Callable[[Mapping[str, Any]], Backend], frozenset[str]]] = {
    "virtual": (_virtual, frozenset({"sample_time_s", "rig", "seed"})),
    "replay": (_replay, frozenset({"sample_time_s", "run"})),
    "fake": (_fake, frozenset({"sample_time_s", "samples"})),
}
