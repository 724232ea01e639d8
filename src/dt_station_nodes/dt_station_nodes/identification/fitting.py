"""From data to an estimate: starts, refinement, covariance and checks."""

from collections.abc import Sequence

import numpy as np

from ..core.run import Array
from .errors import IdentificationError
from .estimate import Estimate, fit_percent
from .initial import linear_start, pole_starts
from .noise import independence, noise_colour, whiteness
from .refinement import Refined, refine
from .sensitivity import respond
from .structure import Data, Structure, time_weights


def estimate(
    structure: Structure, data: Data, starts: Sequence[Sequence[Array]] = (), refinements: int = 3
) -> Estimate:
    """Fit a structure to data by simulation error.

    `starts` are further free denominators (physical, one a path) to begin from, beside those found by instrumental
    variables. Raises IdentificationError where there are fewer samples than parameters or no start can be simulated.
    """
    if len(data) <= structure.size:
        raise IdentificationError(
            f"The run has {len(data)} samples for {structure.size} parameters; "
            "record a longer run or ask for fewer poles."
        )
    candidates = [tuple(s) for s in starts] + list(_searched(structure, data))
    ranked: list[tuple[float, int, Array, float]] = []
    for denominators in candidates:
        rate = _rate(denominators)
        normal = tuple(d / rate ** np.arange(d.size) for d in denominators)
        theta, cost = linear_start(structure, normal, data, rate)
        if np.isfinite(cost) and np.all(np.isfinite(theta)):
            ranked.append((cost, len(ranked), theta, rate))
    if not ranked:
        raise IdentificationError(
            f"No model with {'/'.join(str(p.poles) for p in structure.paths)} poles can be started from this run; "
            "ask for fewer poles or excite the input more."
        )
    ranked.sort(key=lambda item: item[:2])
    best: Refined | None = None
    for _, _, theta, rate in ranked[:refinements]:
        refined = refine(structure, theta, data, rate)
        again = best is not None and abs(refined.cost - best.cost) < 1e-4 * best.cost
        if best is None or refined.cost < best.cost:
            best = refined
        if again:
            break
    assert best is not None
    return conclude(structure, best, data)


def conclude(structure: Structure, refined: Refined, data: Data) -> Estimate:
    """Covariance and checks of a refined fit."""
    residual = data.output - refined.output
    noise = noise_colour(residual, structure.size)
    weights = time_weights(structure, refined.rate_rad_s)
    covariance = noise.covariance(refined.jacobian) * np.outer(weights, weights)
    checks = [whiteness(residual)]
    for index, signal in enumerate(data.inputs):
        checks.append(independence(residual, signal, noise, f"residual is independent of {data.name(index)}"))
    return Estimate(
        structure,
        refined.theta * weights,
        covariance,
        refined.output,
        residual,
        noise,
        fit_percent(data.output, refined.output),
        refined.converged,
        refined.rate_rad_s,
        tuple(checks),
    )


def _searched(structure: Structure, data: Data) -> list[tuple[Array, ...]]:
    """Starts found by instrumental variables, path by path on what the others leave."""
    if len(structure.paths) == 1:
        return [(d,) for d in pole_starts(structure.paths[0], data)]
    chosen: list[Array | None] = [None] * len(structure.paths)
    outputs = [np.zeros(len(data)) for _ in structure.paths]
    for _ in range(2):
        for index, path in enumerate(structure.paths):
            others = sum((y for i, y in enumerate(outputs) if i != index), np.zeros(len(data)))
            alone = Data(data.sample_time_s, (data.inputs[index],), data.output - others)
            single = Structure((path,), initial_states=structure.initial_states, drift=structure.drift)
            options = list(pole_starts(path, alone))
            previous = chosen[index]
            if previous is not None:
                options.append(previous)
            scored: list[tuple[float, int, Array, Array, float]] = []
            for option in options:
                rate = _rate((option,))
                theta, cost = linear_start(single, (option / rate ** np.arange(option.size),), alone, rate)
                scored.append((cost, len(scored), option, theta, rate))
            if not scored:
                continue
            _, _, option, theta, rate = min(scored, key=lambda item: item[:2])
            chosen[index] = option
            theta[-1 - int(structure.drift) :] = 0.0
            outputs[index] = respond(single, theta, alone, rate)[0]
    found = [c for c in chosen if c is not None]
    return [tuple(found)] if len(found) == len(chosen) else []


def _rate(denominators: Sequence[Array]) -> float:
    """Time scale of a set of poles: the geometric mean of their sizes, rad/s."""
    sizes = [abs(root) for d in denominators for root in np.roots(d) if abs(root) > 0.0]
    return float(np.exp(np.mean(np.log(sizes)))) if sizes else 1.0
