"""Runs every experiment of the paper on the model and on the virtual rig."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ...core.channels import Channel
from ...core.run import Run
from ..tuning import Stability, UltimatePoint, stability, ultimate_point
from .bench import Bench
from .loops import Hold, PressureResponse, hold, pressure_response
from .paths import (
    Disturbance,
    ServoPath,
    StaticPressure,
    closed_square,
    disturbance,
    pure_disturbance,
    servo_path,
    square_on_valve,
    static_pressure,
)

PRESSURE_LOOPS = ("pressure_pi", "pressure_pi_zn", "pressure_pi_tuned")
POSITION_LOOPS = ("position_pid", "position_fuzzy", "position_pid_tuned", "position_fuzzy_tuned")


@dataclass(frozen=True, slots=True)
class ObjectResults:
    """All experiments on one object, by controller name where there are several."""

    pressure: Mapping[str, PressureResponse]
    hold: Mapping[str, Hold]
    valve_square: Run
    static: StaticPressure
    servo: ServoPath
    position_square: Run
    disturbance: Disturbance


@dataclass(frozen=True, slots=True)
class Results:
    """Everything the comparison and the figures need."""

    bench: Bench
    model: ObjectResults
    rig: ObjectResults
    kick_cm: float
    drift_cm_s: float
    stability: Mapping[str, Stability]
    ultimate: UltimatePoint


def run_all(bench: Bench, advance: Callable[[str], None] = lambda _: None) -> Results:
    """Run everything; `advance` hears of each experiment done."""
    objects = []
    for name, fresh in (("model", bench.fresh_model), ("rig", bench.fresh_rig)):
        pressure, held = {}, {}
        for controller in PRESSURE_LOOPS:
            pressure[controller] = pressure_response(bench, fresh(), controller)
            advance(f"{controller} on the {name}")
        for controller in POSITION_LOOPS:
            held[controller] = hold(bench, fresh(), controller)
            advance(f"{controller} on the {name}")
        objects.append(
            ObjectResults(
                pressure,
                held,
                square_on_valve(bench, fresh()),
                static_pressure(bench, fresh()),
                servo_path(bench, fresh),
                closed_square(bench, fresh()),
                disturbance(bench, fresh()),
            )
        )
        advance(f"open loops on the {name}")
    kick, drift = pure_disturbance(bench)
    judged = {}
    for controller in (*PRESSURE_LOOPS, *POSITION_LOOPS):
        channel = Channel.PRESSURE if controller in PRESSURE_LOOPS else Channel.POSITION
        judged[controller] = stability(bench.model, channel, bench.controllers[controller], bench.sample_time_s)
    ultimate = ultimate_point(bench.model, Channel.PRESSURE, bench.sample_time_s, 1e-6)
    return Results(bench, objects[0], objects[1], kick, drift, judged, ultimate)


# Experiments `run_all` reports to `advance`.
STEPS = 2 * (len(PRESSURE_LOOPS) + len(POSITION_LOOPS) + 1)
