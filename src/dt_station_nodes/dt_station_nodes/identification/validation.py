"""How well a given model does on a run, judged as an estimate is."""

import numpy as np

from ..core.channels import Channel
from ..core.models import ModelSpec, PlantModel
from ..core.run import Run
from .estimate import fit_percent


def model_fit(spec: ModelSpec, run: Run, channel: Channel) -> float:
    """Free-run fit of a model on a run's voltages and measured pressure; offset (and drift of an integrator) fitted."""
    nothing = np.zeros(len(run))
    load, servo = run.get("load_voltage_v"), run.get("servo_voltage_v")
    pressure = run.get("pressure_pa")
    given = pressure if channel is Channel.POSITION else None
    simulated = PlantModel(spec, run.sample_time_s).simulate(
        nothing if load is None else load,
        nothing if servo is None else servo,
        given,
        interpolate_pressure=True,
    )
    output = simulated.pressure_pa if channel is Channel.PRESSURE else simulated.position_m
    measured = run.signals[channel.signal]
    columns = [np.ones(len(run))]
    if channel is Channel.POSITION:
        columns.append(run.time_s - run.start_s)
    regressors = np.column_stack(columns)
    left = measured - output
    return fit_percent(measured, output + regressors @ np.linalg.lstsq(regressors, left, rcond=None)[0])


def path_lag_s(spec: ModelSpec | None, channel: Channel) -> float:
    """Lag of a model's linear path at standstill, s, integrators left out; 0 without such a path."""
    if spec is None or channel not in spec.paths:
        return 0.0
    path = spec.paths[channel]
    ends = [np.trim_zeros(np.asarray(c, dtype=np.float64), "b") for c in (path.denominator, path.numerator)]
    behind, ahead = (float(c[-2] / c[-1]) if c.size > 1 else 0.0 for c in ends)
    return max(0.0, (behind - ahead) * path.time_scale)
