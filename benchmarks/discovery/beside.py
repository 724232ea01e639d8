"""Discovery beside sparse regression on the same hidden runs: names found, and time.

    pip install pysindy scikit-learn        # needed by this benchmark only
    python -m benchmarks.discovery.beside --out docs/beside.md

PySINDy (STLSQ) and scikit-learn (LassoCV) get what their users would give them: position and speed by a smoothing
filter, voltage, pressure, and a library with one column for every effect that a static column can express, in the
words of our vocabulary. The name they give is the column that moves the acceleration most, beyond the linear ones.
"""

import importlib
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from scipy import signal

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings, Verdict, discover

from .cases import Case, make
from .examine import run_of
from .library import POSITION
from .plant import REST_MPA

Array = NDArray[np.float64]
Answer = tuple[str, int]  # the name given ("" for none), terms kept beyond the linear ones

EFFECTS = (
    "", "asymmetric_gain", "bias", "cubic_stiffness", "dead_zone", "delay", "extra_lag", "friction", "gain_drift",
    "hysteresis", "leakage", "load_dependent_gain", "periodic_disturbance", "saturation", "backlash", "rate_limit",
    "resonance",
)  # fmt: skip
NONE = "nothing"
SILENT = "does not know"
SMOOTHING = 15  # samples of the filter that differentiates
KEPT = 0.02  # of the acceleration: a column that moves less is not counted


@dataclass(frozen=True, slots=True)
class Regression:
    """Acceleration (n,), linear columns and named columns, all of zero mean and unit spread but the acceleration."""

    target: Array
    linear: Array
    named: Array
    names: tuple[str, ...]


def _plays(u: Array, half: float) -> Array:
    out, state = np.empty_like(u), 0.0
    for k, value in enumerate(u):
        state = min(max(state, value - half), value + half)
        out[k] = state
    return out


def regression(run: Run) -> Regression:
    """The regression that a user of either tool would set up."""
    step = run.sample_time_s
    y, p, u = (run.signals[name] for name in ("position_m", "pressure_pa", "servo_voltage_v"))
    speed = signal.savgol_filter(y, SMOOTHING, 3, deriv=1, delta=step)
    target = signal.savgol_filter(y, SMOOTHING, 3, deriv=2, delta=step)
    # What the filter does to the output it must do to the input too.
    u = signal.savgol_filter(u, SMOOTHING, 3)
    p = signal.savgol_filter(p, SMOOTHING, 3)
    time_s = np.arange(len(y)) * step
    high, fast = float(np.quantile(np.abs(u), 0.98)), float(np.quantile(np.abs(speed), 0.98))
    linear = np.column_stack([speed, u, np.gradient(p, step)])
    left = (
        target
        - np.column_stack([linear, np.ones(len(y))])
        @ np.linalg.lstsq(np.column_stack([linear, np.ones(len(y))]), target, rcond=None)[0]
    )
    peak = float(np.fft.rfftfreq(len(left), step)[1 + int(np.argmax(np.abs(np.fft.rfft(left))[1:]))])
    columns = {
        "asymmetric_gain": [np.abs(u)],
        "bias": [np.ones(len(y))],
        "cubic_stiffness": [(y - y.mean()) ** 3],
        "dead_zone": [np.clip(u, -w * high, w * high) for w in (0.03, 0.1, 0.25)],
        "saturation": [u - np.clip(u, -w * high, w * high) for w in (0.5, 0.7, 0.85)],
        "delay or extra_lag": [np.gradient(u, step)],
        "friction": [np.tanh(speed / (0.02 * fast))],
        "gain_drift": [u * time_s],
        "hysteresis": [u - _plays(u, w * high) for w in (0.05, 0.15)],
        "leakage": [p - p.min()],
        "load_dependent_gain": [u * (p - p.min())],
        "periodic_disturbance": [np.sin(2 * np.pi * peak * time_s), np.cos(2 * np.pi * peak * time_s)],
    }
    names = tuple(name for name, several in columns.items() for _ in several)
    named = np.column_stack([column for several in columns.values() for column in several])
    inside = slice(SMOOTHING, -SMOOTHING)

    def even(block: Array) -> Array:
        spread = np.where(np.std(block, axis=0) > 0.0, np.std(block, axis=0), np.abs(block).max(axis=0))
        return np.asarray(block / np.where(spread > 0.0, spread, 1.0))

    return Regression(target[inside], even(linear)[inside], even(named)[inside], names)


def _named(found: Array, problem: Regression) -> Answer:
    sizes = np.abs(found[problem.linear.shape[1] :]) / np.std(problem.target)
    kept = np.flatnonzero(sizes > KEPT)
    return (problem.names[int(np.argmax(sizes))], len(kept)) if len(kept) else ("", 0)


def by_sindy(run: Run) -> Answer:
    """Sequentially thresholded least squares, as PySINDy does it by default."""
    pysindy = importlib.import_module("pysindy")
    problem = regression(run)
    columns = np.column_stack([problem.linear, problem.named])
    optimizer = pysindy.STLSQ(threshold=0.05 * float(np.std(problem.target)), alpha=1e-3)
    optimizer.fit(columns, problem.target[:, None])
    return _named(np.asarray(optimizer.coef_, dtype=np.float64).ravel(), problem)


def by_lasso(run: Run) -> Answer:
    """Lasso with its penalty by cross-validation, as scikit-learn does it by default."""
    linear_model: Any = importlib.import_module("sklearn.linear_model")
    problem = regression(run)
    columns = np.column_stack([problem.linear, problem.named])
    model = linear_model.LassoCV(cv=5, max_iter=5000).fit(columns, problem.target)
    return _named(np.asarray(model.coef_, dtype=np.float64), problem)


def by_discovery(run: Run) -> Answer:
    """Ours, on the position path of the paper's linear model, which the load moves by what it is above rest."""
    path = {
        "numerator": [206.4],
        "denominator": [1, 23.34, 0],
        "scale": 0.01,
        "disturbance": {"numerator": [64.72, -16.45], "denominator": [1, 76.54, 2009, 0]},
    }
    spec = ModelSpec.model_validate({"name": "paper", "paths": {Channel.POSITION: path}})
    above = {**run.signals, "pressure_pa": run.signals["pressure_pa"] - 1e6 * REST_MPA}
    result = discover(replace(run, signals=above), spec, settings=DiscoverySettings(jobs=2))
    names = [effect.name for effect in result.effects if effect.name != "parameter_mismatch"]
    if result.verdict is Verdict.UNEXPLAINED:
        return SILENT, 0
    return "+".join(names), len(names)


TOOLS: dict[str, Callable[[Run], Answer]] = {
    "discover": by_discovery,
    "PySINDy, STLSQ": by_sindy,
    "scikit-learn, LassoCV": by_lasso,
}


def _right(said: str, truth: str) -> bool:
    return said == truth or (truth != "" and truth in said.split(" or "))


def main(
    out: Annotated[Path | None, typer.Option(help="Where to write the page.")] = None,
    seed: Annotated[int, typer.Option(help="Another seed, other runs.")] = 1,
    noise_db: Annotated[float, typer.Option(help="Signal to noise, dB.")] = 40.0,
) -> None:
    """Print, and write, one row an effect."""
    rows, right = [], dict.fromkeys(TOOLS, 0)
    seconds = dict.fromkeys(TOOLS, 0.0)
    shapes = ("triangle", "sine", "sawtooth")
    for index, effect in enumerate(EFFECTS):
        effects = ((effect, POSITION, "other", 1),) if effect else ()
        made = make(Case("beside", shapes[index % 3], noise_db, seed, effects, seconds=24.0))
        run = run_of(made.runs[0], made.references[0])
        cells = [effect or NONE]
        for tool, ask in TOOLS.items():
            begin = time.perf_counter()
            said, terms = ask(run)
            seconds[tool] += time.perf_counter() - begin
            good = _right(said, effect)
            right[tool] += good
            more = f" and {terms - 1} more" if terms > 1 and tool != "discover" else ""
            cells.append(f"{'**' if good else ''}{said or NONE}{'**' if good else ''}{more}")
        rows.append("| " + " | ".join(cells) + " |")
        typer.echo(rows[-1])
    count = len(EFFECTS)
    rows.append("| right | " + " | ".join(f"{right[tool]} of {count}" for tool in TOOLS) + " |")
    rows.append("| seconds a run | " + " | ".join(f"{seconds[tool] / count:.2f}" for tool in TOOLS) + " |")
    typer.echo("\n".join(rows[-2:]))
    if out is not None:
        head = "| hidden | " + " | ".join(TOOLS) + " |\n|" + " --- |" * (len(TOOLS) + 1)
        out.write_text(PAGE.format(head=head, rows="\n".join(rows), seed=seed, noise=noise_db), encoding="utf-8")


PAGE = """# Discovery beside sparse regression

Hidden runs of the position path (24 s at 20 ms, {noise:g} dB, seed {seed}, forms other than the candidates'), alike for
all. PySINDy and scikit-learn get position, speed and acceleration by a smoothing filter, and a library with a column
for each effect that a static column can express; the name they give is the column with the largest share of the
acceleration beyond the linear ones, "and n more" what else they keep above 2 % of it. They have no word for effects
with a memory of their own (backlash, rate limit, resonance) and none for "nothing is missing"; they are faster, because
they solve one regression where discovery simulates each candidate with the model. Right answers are bold.

{head}
{rows}

Regenerate: `pip install pysindy scikit-learn`, then `python -m benchmarks.discovery.beside --out docs/beside.md`.
"""


if __name__ == "__main__":
    typer.run(main)
