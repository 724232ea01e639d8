"""`dt-station simulate`: a model without the graph, from waveforms or from a run's own inputs."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .common import (
    ForceOption,
    JsonOption,
    OutOption,
    UserError,
    console,
    emit_json,
    find_config,
    load_model,
    output_dir,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..core.channels import Channel
    from ..core.control import LoopConfig
    from ..core.models import ModelSpec
    from ..core.run import Run
    from ..core.waveforms import Waveform

    Array = NDArray[np.float64]

_LONGEST = 20_000_000


def simulate(
    model: Annotated[str, typer.Argument(help="Model, a path or a name in config/models.")],
    *,
    load: Annotated[str, typer.Option(help="Load voltage, or its loop's set-point with --load-controller.")] = "0V",
    servo: Annotated[str, typer.Option(help="Servo voltage, or its set-point with --position-controller.")] = "0V",
    load_controller: Annotated[str, typer.Option(help="Controller file closing the pressure loop.")] = "",
    position_controller: Annotated[str, typer.Option(help="Controller file closing the position loop.")] = "",
    run: Annotated[Path | None, typer.Option(help="Take the voltages from a run instead.")] = None,
    data_map: Annotated[str, typer.Option("--map", help="Map of foreign columns, a path or a name.")] = "",
    own_pressure: Annotated[
        bool, typer.Option("--own-pressure", help="With --run: the simulated, not the measured pressure as load.")
    ] = False,
    duration: Annotated[float, typer.Option(help="Length, s.")] = 20.0,
    sample_time: Annotated[float, typer.Option(help="Sample time, s.")] = 0.02,
    out: OutOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Simulate a model and leave run.csv and a picture; with --run also the fit to what was measured.

    A waveform is written SHAPE,amplitude=..,offset=..,frequency=..,phase=..,duty=.. or as a plain value.

    Example: dt-station simulate paper --load square,amplitude=2.5V,offset=2.5V,frequency=0.25Hz --duration 24
    """
    from ..core.channels import Channel
    from .typed_waveform import parse_waveform

    spec, _ = load_model(model)
    check_stable(spec, model)
    loops = _loops(load_controller, position_controller)
    if run is not None:
        if loops:
            raise UserError("--run gives the voltages, so it goes with no controller.")
        measured, result = _from_run(spec, run, find_config("maps", data_map) if data_map else None, own_pressure)
    else:
        if not (0.0 < sample_time < 100.0 and 2 <= duration / sample_time <= _LONGEST):
            raise UserError(f"--duration {duration:g} and --sample-time {sample_time:g}: give 2 to {_LONGEST} samples.")
        texts = {Channel.PRESSURE: load, Channel.POSITION: servo}
        waveforms = {c: parse_waveform(t, _dimension(c, c in loops)) for c, t in texts.items()}
        measured, result = None, _from_waveforms(spec, waveforms, loops, sample_time, round(duration / sample_time))
    folder = output_dir("simulate", out, force)
    _leave(spec, result, measured, folder, json)


def check_stable(spec: "ModelSpec", name: str) -> None:
    """Raise UserError naming the path of a model that is unstable."""
    from ..identification import TransferFunction

    for channel, path in spec.paths.items():
        for part, what in ((path, ""), (path.disturbance, " disturbance")):
            if (
                part is not None
                and len(part.denominator) > 1
                and not TransferFunction((1.0,), part.denominator).stable()
            ):
                raise UserError(
                    f"model {name}: the {channel.value}{what} path is unstable, it grows without bound; "
                    "look at its denominator."
                )


def _dimension(channel: "Channel", closed: bool) -> str:
    if not closed:
        return "voltage"
    return "pressure" if channel.value == "pressure" else "length"


def _loops(load: str, position: str) -> "dict[Channel, LoopConfig]":
    from ..core.channels import Channel
    from ..core.control import LoopConfig

    wanted = {Channel.PRESSURE: load, Channel.POSITION: position}
    return {
        c: LoopConfig.from_yaml(find_config("controllers", name).read_text(encoding="utf-8"))
        for c, name in wanted.items()
        if name
    }


def _from_waveforms(
    spec: "ModelSpec",
    waveforms: "dict[Channel, Waveform]",
    loops: "dict[Channel, LoopConfig]",
    sample_time_s: float,
    samples: int,
) -> "Run":
    """Voltages from waveforms, or loops closed around the model sample by sample."""
    import numpy as np

    from ..core.channels import Channel
    from ..core.control import ControlInput, LoopController
    from ..core.models import ModelInput, PlantModel
    from ..core.run import Run
    from ..core.waveforms import waveform_samples

    model = PlantModel(spec, sample_time_s)
    played = {c: waveform_samples(w, sample_time_s, samples) for c, w in waveforms.items()}
    signals = {c.setpoint_signal: played[c] for c in loops}
    volts = {c: played[c] if c not in loops else np.zeros(samples) for c in Channel}
    if loops:
        controllers = {c: LoopController(config, sample_time_s) for c, config in loops.items()}
        states = {c: controller.initial_state() for c, controller in controllers.items()}
        measured = {c: np.zeros(samples) for c in Channel}
        state = model.initial_state()
        # the output of a sample does not depend on its own voltages, so any will do to read it
        for k in range(samples):
            _, seen = model.step(state, ModelInput(0.0, 0.0))
            outputs = {Channel.PRESSURE: seen.pressure_pa, Channel.POSITION: seen.position_m}
            for c, controller in controllers.items():
                given = ControlInput(float(played[c][k]), outputs[c], seen.pressure_pa)
                states[c], answer = controller.step(states[c], given)
                volts[c][k] = answer.voltage_v
            state, _ = model.step(
                state, ModelInput(float(volts[Channel.PRESSURE][k]), float(volts[Channel.POSITION][k]))
            )
            for c in Channel:
                measured[c][k] = outputs[c]
    else:
        simulated = model.simulate(volts[Channel.PRESSURE], volts[Channel.POSITION])
        measured = {Channel.PRESSURE: simulated.pressure_pa, Channel.POSITION: simulated.position_m}
    for c in spec.paths:
        signals[c.voltage_signal] = volts[c]
        signals[c.signal] = measured[c]
    return Run(sample_time_s, signals, source=f"simulation of {spec.name}")


def _from_run(spec: "ModelSpec", path: Path, data_map: Path | None, own_pressure: bool) -> "tuple[Run, Run]":
    """The measured run, and the model on its voltages from the measured start."""
    import numpy as np

    from ..core.channels import Channel
    from ..core.models import PlantModel
    from ..core.run import Run
    from ..records import load_run

    measured = load_run(path, data_map)
    shared = [c for c in measured.channels() if c in spec.paths]
    if not shared:
        raise UserError(f"{path} has no channel with voltage and output that model {spec.name} describes.")
    volts = [measured.get(c.voltage_signal) for c in Channel]
    load, servo = (np.zeros(len(measured)) if v is None else v for v in volts)
    starts = {c: measured.get(c.signal) for c in Channel}
    first = {c: None if values is None else float(values[0]) for c, values in starts.items()}
    model = PlantModel(spec, measured.sample_time_s)
    state = model.initial_state(first[Channel.POSITION], first[Channel.PRESSURE])
    pressure = None if own_pressure else starts[Channel.PRESSURE]
    simulated = model.simulate(load, servo, pressure, state, interpolate_pressure=True)
    outputs = {Channel.PRESSURE: simulated.pressure_pa, Channel.POSITION: simulated.position_m}
    signals: dict[str, Array] = {}
    for c in shared:
        signals[c.voltage_signal] = measured.signals[c.voltage_signal]
        signals[c.signal] = outputs[c]
    source = f"simulation of {spec.name} on {measured.source}"
    return measured, Run(measured.sample_time_s, signals, measured.start_s, source, measured.units)


def _leave(spec: "ModelSpec", result: "Run", measured: "Run | None", folder: Path, json: bool) -> None:
    from ..core.channels import Channel
    from ..identification import fit_percent
    from ..records import write_csv
    from .simulate_picture import draw

    files = {"run": folder / "run.csv", "picture": folder / "simulation.png"}
    write_csv(result, files["run"])
    draw(result, measured, files["picture"])
    rows: list[dict[str, Any]] = []
    for channel in Channel:
        values = result.get(channel.signal)
        if values is None:
            continue
        row: dict[str, Any] = {
            "channel": channel.value,
            "from": float(values.min()),
            "to": float(values.max()),
            "end": float(values[-1]),
            "unit": result.unit(channel.signal),
        }
        if measured is not None:
            row["fit_percent"] = fit_percent(measured.signals[channel.signal], values)
        rows.append(row)
    if json:
        emit_json({"model": spec.name, "samples": len(result), "rows": rows, "files": files})
        return
    from rich.console import Console
    from rich.table import Table

    table = Table(*rows[0], title=f"{result.source}: {len(result)} samples of {result.sample_time_s:g} s")
    for row in rows:
        table.add_row(*(f"{v:.5g}" if isinstance(v, float) else str(v) for v in row.values()))
    Console().print(table)
    for name, path in files.items():
        console.print(f"{name}: {path}", soft_wrap=True)
