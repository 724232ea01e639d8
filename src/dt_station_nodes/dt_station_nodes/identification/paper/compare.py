"""The comparison: every figure of the paper beside ours, with what to make of it."""

import control
import numpy as np

from ..tuning import continuous_pi, discrete_pi, printed
from . import published
from .compare_control import control_rows
from .results import Results
from .row import Row, Status, judged_printed, judged_same, near

NAMES = {"pressure_pi": "PI optimised", "pressure_pi_zn": "PI Ziegler-Nichols"}


def rows(results: Results) -> list[Row]:
    """All rows, in the paper's order."""
    return [*_models(results), *_disturbance(results), *_table_1(results), *control_rows(results)]


def _models(results: Results) -> list[Row]:
    model, rig = results.model, results.rig
    gain, lag = published.SERVO_GAIN_CM_S_V, published.SERVO_LAG_S
    by_hand = "simulated response of the shipped model against the quotient of the printed coefficients"
    from_rig = "read off the virtual rig, which is physics calibrated to the paper's models, not the models themselves"
    return [
        _same("pressure path (1): DC gain, model", published.PRESSURE_GAIN, model.static.gain_mpa_v, "MPa/V", 1e-3,
              f"{by_hand}; slope of a slow triangle between 1 and 4 V"),
        _same("pressure path: DC gain, virtual rig", published.PRESSURE_GAIN, rig.static.gain_mpa_v, "MPa/V", 0.05,
              from_rig),
        _same("rest pressure, virtual rig", published.REST_MPA, rig.static.rest_mpa, "MPa", 0.02, from_rig),
        Row("hysteresis of the relief valve at 2.5 V, virtual rig", None, rig.static.width_v, "V",
            Status.NOT_COMPARABLE, "the paper names the hysteresis, prints no width and does not model it"),
        _same("position path (5): K, model", gain, model.servo.gain_cm_s_v, "cm/s/V", 1e-3, by_hand),
        _same("position path: K, virtual rig", gain, rig.servo.gain_cm_s_v, "cm/s/V", 0.05, from_rig),
        _same("position path (5): T, model", lag, model.servo.lag_s, "s", 0.01, by_hand),
        _same("position path: T, virtual rig", lag, rig.servo.lag_s, "s", 0.1, from_rig),
    ]  # fmt: skip


def _disturbance(results: Results) -> list[Row]:
    time_s = np.arange(0.0, 1.0, 1e-3)
    _, response = control.forced_response(control.tf(*published.DISTURBANCE), time_s, np.ones(time_s.size))
    kick = float(np.max(response))
    rig = results.rig.disturbance
    drift = published.DRIFT_CM_S_MPA
    printed_path = "the printed path (6) by python-control's response to a step of 1 MPa, ours by the twin's own kernel"
    on_rig = "servo valve at 0 V, load stepped by 1 V, per MPa reached; the rig's step is as slow as its valve"
    return [
        _same("disturbance path (6): kick, model", kick, results.kick_cm, "cm/MPa", 0.01, printed_path),
        _same("disturbance path (6): drift, model", drift, results.drift_cm_s, "cm/s/MPa", 1e-3, printed_path),
        _same("disturbance path: kick, virtual rig", kick, rig.kick_cm_mpa, "cm/MPa", 0.25, on_rig),
        _same("disturbance path: drift, virtual rig", drift, rig.drift_cm_s_mpa, "cm/s/MPa", 0.25, on_rig),
    ]


def _table_1(results: Results) -> list[Row]:
    found = []
    labels = ("continuous, Kr", "continuous, Ki", "discrete, a", "discrete, b")
    for name, wanted in published.TABLE_1.items():
        config = results.bench.controllers[name].pi
        if config is None:
            continue
        ours = (*continuous_pi(config), *discrete_pi(config, results.bench.sample_time_s))
        for label, paper, value in zip(labels, wanted, ours, strict=True):
            text = printed(value)
            why = f"printed {paper}, ours prints {text}; zero-order hold, MATLAB's c2d default, as Kr - Kr Ts/Ti"
            what = f"Table 1, {NAMES[name]}: {label}"
            found.append(Row(what, float(paper), float(text), _unit(label), judged_printed(paper, text), why))
    point = results.ultimate
    gain, time_s = published.ZIEGLER_NICHOLS
    why = (
        f"ours from the sampled linear path's ultimate gain {point.gain:.4g} V/MPa and period {point.period_s:.4g} s; "
        "the paper's Simulink model holds a dead zone and a saturation whose values it does not print, and it prints "
        "no ultimate gain"
    )
    found.append(Row("Ziegler-Nichols: Kr", gain, 0.45 * point.gain, "V/MPa", Status.NOT_COMPARABLE, why))
    ours_s = point.period_s / 1.2
    status = Status.REPRODUCED if near(time_s, ours_s, 0.1) else Status.NOT_COMPARABLE
    found.append(Row("Ziegler-Nichols: Ti", time_s, ours_s, "s", status, f"{why}; the period nearly agrees"))
    return found


def _unit(label: str) -> str:
    return "V/(MPa s)" if label.endswith("Ki") else "V/MPa"


def _same(what: str, paper: float, ours: float, unit: str, tolerance: float, why: str) -> Row:
    return Row(what, paper, ours, unit, judged_same(paper, ours, tolerance), f"{why}; within {tolerance:.2g} relative")
