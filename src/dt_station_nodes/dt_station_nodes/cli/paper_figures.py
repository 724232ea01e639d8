"""The paper's figures redrawn from our runs; matplotlib, one function a figure."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ..core.control import FuzzyConfig, FuzzyVariable, memberships
from ..core.run import Run
from ..identification.paper import Hold, PressureResponse, Results

MPA, CM = 1e-6, 100.0
SETPOINT, FIRST, SECOND, LOAD = "black", "tab:blue", "tab:red", "tab:purple"
ZOOM = (8.0, 12.5)


def draw(results: Results, folder: Path) -> dict[str, Path]:
    """All figures as PNG files; paths by figure number."""
    files = {}
    for number, function in FIGURES.items():
        figure = function(results)
        figure.suptitle(f"Figure {number} of the paper from our runs. {function.__doc__}", fontsize=10)
        FigureCanvasAgg(figure)
        files[number] = folder / f"figure_{int(number):02d}.png"
        figure.savefig(files[number], dpi=120)
    return files


def _new(rows: int = 1, columns: int = 1, height: float = 3.6) -> tuple[Figure, Any]:
    figure = Figure(figsize=(9.0, height * rows), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False)


def _label(axes: Axes, x: str, y: str, title: str = "") -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(title, fontsize=9)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)


def _pressure(axes: Axes, run: Run, colour: str, label: str) -> None:
    axes.plot(run.time_s, run.signals["pressure_pa"] * MPA, color=colour, lw=1.0, label=label)


def figure_6(results: Results) -> Figure:
    """Identification of the pressure path: 0/5 V square in, pressure out."""
    figure, axes = _new(2, height=2.6)
    rig, model = results.rig.valve_square, results.model.valve_square
    axes[0, 0].step(rig.time_s, rig.signals["load_voltage_v"], where="post", color=SETPOINT, label="voltage")
    _label(axes[0, 0], "time, s", "V")
    _pressure(axes[1, 0], rig, FIRST, "virtual rig")
    _pressure(axes[1, 0], model, SECOND, "model (1)")
    _label(axes[1, 0], "time, s", "pressure, MPa")
    return figure


def figure_7(results: Results) -> Figure:
    """Static characteristics of the relief valve."""
    figure, axes = _new()
    plot = axes[0, 0]
    for results_of, colour, label in (
        (results.rig, FIRST, "virtual rig (with hysteresis)"),
        (results.model, SECOND, "nonlinear model"),
    ):
        run = results_of.static.run
        plot.plot(run.signals["load_voltage_v"], run.signals["pressure_pa"] * MPA, color=colour, lw=1.0, label=label)
    line = np.array([0.0, 5.0])
    model = results.model.static
    plot.plot(line, model.rest_mpa + model.gain_mpa_v * line, "k--", lw=1.0, label="linear model")
    _label(plot, "voltage, V", "pressure, MPa")
    return figure


def _square_response(axes: Axes, response: PressureResponse, colour: str, label: str) -> None:
    run, figures = response.run, response.within_2_percent
    settled = "never" if figures.settling_s is None else f"{figures.settling_s:.2g} s"
    _pressure(axes, run, colour, f"{label}: settles in {settled}, overshoot {figures.overshoot_percent:.2g} %")


def _load_setpoint(axes: Axes, run: Run) -> None:
    axes.step(
        run.time_s, run.signals["pressure_setpoint_pa"] * MPA, where="post", color=SETPOINT, lw=0.8, label="set-point"
    )
    axes.set_xlim(0.0, 12.0)


def figure_9(results: Results) -> Figure:
    """Simulated load loop with both published settings."""
    figure, axes = _new()
    pressure = results.model.pressure
    _load_setpoint(axes[0, 0], pressure["pressure_pi"].run)
    _square_response(axes[0, 0], pressure["pressure_pi_zn"], SECOND, "Ziegler-Nichols")
    _square_response(axes[0, 0], pressure["pressure_pi"], FIRST, "optimised")
    _square_response(axes[0, 0], pressure["pressure_pi_tuned"], "tab:green", "ours")
    _label(axes[0, 0], "time, s", "pressure, MPa", "simulation")
    return figure


def figure_10(results: Results) -> Figure:
    """The load loop on the rig with both published settings."""
    figure, axes = _new(2, height=2.8)
    pressure = results.rig.pressure
    for row, name, label in ((0, "pressure_pi", "a: optimised"), (1, "pressure_pi_zn", "b: Ziegler-Nichols")):
        _load_setpoint(axes[row, 0], pressure[name].run)
        _square_response(axes[row, 0], pressure[name], FIRST, "virtual rig")
        _label(axes[row, 0], "time, s", "pressure, MPa", label)
    return figure


def figure_12(results: Results) -> Figure:
    """Position path: closed-loop identification and static characteristic."""
    figure, axes = _new(1, 2)
    rig, model = results.rig, results.model
    run = rig.position_square
    axes[0, 0].step(
        run.time_s, CM * run.signals["position_setpoint_m"], where="post", color=SETPOINT, lw=0.8, label="set-point"
    )
    axes[0, 0].plot(run.time_s, CM * run.signals["position_m"], color=FIRST, lw=1.0, label="virtual rig")
    axes[0, 0].plot(
        run.time_s, CM * model.position_square.signals["position_m"], color=SECOND, lw=1.0, label="model (5)"
    )
    _label(axes[0, 0], "time, s", "position, cm", "a: loop closed by 1 V/cm")
    axes[0, 1].plot(rig.servo.voltage_v, rig.servo.velocity_cm_s, "o", color=FIRST, ms=4, label="virtual rig")
    axes[0, 1].plot(model.servo.voltage_v, model.servo.velocity_cm_s, color=SECOND, lw=1.0, label="model (5)")
    _label(axes[0, 1], "voltage, V", "velocity, cm/s", "b: static characteristic")
    return figure


def figure_13(results: Results) -> Figure:
    """Disturbance path: pressure in, displacement out."""
    figure, axes = _new(2, height=2.6)
    for disturbance, colour, label in (
        (results.rig.disturbance, FIRST, "virtual rig"),
        (results.model.disturbance, SECOND, "model (1) and (6)"),
    ):
        run = disturbance.run
        _pressure(axes[0, 0], run, colour, label)
        axes[1, 0].plot(run.time_s, CM * run.signals["position_m"], color=colour, lw=1.0, label=label)
    _label(axes[0, 0], "time, s", "pressure, MPa")
    _label(axes[1, 0], "time, s", "position, cm", "servo valve at 0 V")
    return figure


def figure_14(results: Results) -> Figure:
    """Memberships of the fuzzy controller and one defuzzification."""
    figure, axes = _new(2, 2, height=2.8)
    config = results.bench.controllers["position_fuzzy"].fuzzy
    if config is None:
        return figure
    places = ((0, 0, "error", "a: error"), (0, 1, "load", "b: load pressure"), (1, 0, "voltage", "c: control"))
    for row, column, name, title in places:
        variable: FuzzyVariable = getattr(config, name)
        x = np.linspace(variable.range[0], variable.range[1], 601)
        for term, degrees in zip(variable.terms, memberships(variable, x), strict=True):
            axes[row, column].plot(x, degrees, lw=1.0, label=term.replace("_", " "))
        _label(axes[row, column], f"{name}, {variable.unit}", "membership", title)
    _defuzzification(axes[1, 1], config, error=0.8, load=3.5)
    return figure


def _defuzzification(axes: Axes, config: FuzzyConfig, error: float, load: float) -> None:
    x = np.linspace(config.voltage.range[0], config.voltage.range[1], 1201)
    shapes = memberships(config.voltage, x)
    of_error = memberships(config.error, np.array([error]))[:, 0]
    of_load = memberships(config.load, np.array([load]))[:, 0]
    errors, loads, voltages = list(config.error.terms), list(config.load.terms), list(config.voltage.terms)
    union = np.zeros_like(x)
    for e, p, u in config.rule_list():
        fired = min(of_error[errors.index(e)], of_load[loads.index(p)])
        union = np.maximum(union, np.minimum(fired, shapes[voltages.index(u)]))
    centre = float(np.sum(x * union) / np.sum(union))
    axes.fill_between(x, union, alpha=0.4, color=FIRST, label=f"error {error:g} cm, load {load:g} MPa")
    axes.axvline(centre, color=SECOND, lw=1.0, label=f"centre of gravity {centre:.2f} V")
    _label(axes, "voltage, V", "membership", "d: defuzzification")


def _held(axes: Axes, held: Mapping[str, tuple[Hold, str]]) -> None:
    first = next(iter(held.values()))[0].run
    axes.plot(first.time_s, CM * first.signals["position_setpoint_m"], color=SETPOINT, lw=0.8, label="set-point")
    for label, (hold, colour) in held.items():
        text = f"{label}: index {hold.index:.3g} mm²"
        axes.plot(hold.run.time_s, CM * hold.run.signals["position_m"], color=colour, lw=1.0, label=text)
    pressure = axes.twinx()
    pressure.plot(first.time_s, first.signals["pressure_pa"] * MPA, color=LOAD, lw=0.6, alpha=0.6)
    pressure.set_ylabel("pressure, MPa", color=LOAD)


def _hold_figure(held: Mapping[str, tuple[Hold, str]], title: str) -> Figure:
    figure, axes = _new(2, height=2.8)
    _held(axes[0, 0], held)
    _label(axes[0, 0], "time, s", "position, cm", title)
    _held(axes[1, 0], held)
    axes[1, 0].set_xlim(*ZOOM)
    centre = CM * next(iter(held.values()))[0].run.signals["position_setpoint_m"][-1]
    axes[1, 0].set_ylim(centre - 0.03, centre + 0.03)
    _label(axes[1, 0], "time, s", "position, cm", "close-up")
    return figure


def figure_16(results: Results) -> Figure:
    """Simulated hold under square load, PID and fuzzy."""
    held = results.model.hold
    return _hold_figure(
        {"PID": (held["position_pid"], "tab:green"), "fuzzy": (held["position_fuzzy"], FIRST)}, "simulation"
    )


def figure_17(results: Results) -> Figure:
    """Hold under square load on the rig, PID."""
    return _hold_figure({"PID": (results.rig.hold["position_pid"], "tab:green")}, "virtual rig, PID")


def figure_18(results: Results) -> Figure:
    """Hold under square load on the rig, fuzzy."""
    return _hold_figure({"fuzzy": (results.rig.hold["position_fuzzy"], FIRST)}, "virtual rig, fuzzy")


FIGURES: dict[str, Callable[[Results], Figure]] = {
    "6": figure_6,
    "7": figure_7,
    "9": figure_9,
    "10": figure_10,
    "12": figure_12,
    "13": figure_13,
    "14": figure_14,
    "16": figure_16,
    "17": figure_17,
    "18": figure_18,
}
