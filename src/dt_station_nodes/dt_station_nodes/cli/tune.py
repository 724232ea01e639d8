"""`dt-station tune`: settings for a controller, with their forms, figures and margins."""

from enum import Enum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .common import ForceOption, JsonOption, OutOption, UserError, emit_json, find_config, load_model, output_dir

if TYPE_CHECKING:
    from ..core.control import LoopConfig
    from ..identification.tuning import Experiment, Trial, UltimatePoint


class Method(str, Enum):
    """Where the settings come from."""

    OPTIMISE = "optimise"
    ZIEGLER_NICHOLS = "ziegler-nichols"
    RELAY = "relay"
    CHECK = "check"


class Loop(str, Enum):
    """Which loop to tune."""

    PRESSURE = "pressure"
    POSITION = "position"


class Place(str, Enum):
    """Where the relay works."""

    MODEL = "model"
    RIG = "rig"
    STATION = "station"


_USUAL = {"pressure": "pressure_pi", "position": "position_pid"}
_FUZZY = {"position": "position_fuzzy"}


def tune(
    loop: Annotated[Loop, typer.Argument(help="pressure or position.")],
    *,
    method: Annotated[Method, typer.Option(help="check judges the settings as they are.")] = Method.OPTIMISE,
    controller: Annotated[
        str,
        typer.Option(
            help="Controller to start from, by path or name [pressure_pi, position_pid, fuzzy: position_fuzzy]."
        ),
    ] = "",
    mode: Annotated[str, typer.Option(help="pi, pid or fuzzy [the controller's own].")] = "",
    model: Annotated[str, typer.Option(help="Model to tune on, by path or name.")] = "paper",
    sample_time: Annotated[float, typer.Option(help="Sample time, s.")] = 0.02,
    overshoot: Annotated[float | None, typer.Option(help="optimise: at most, % [0.5].")] = None,
    gain_margin: Annotated[float | None, typer.Option(help="optimise: at least, ratio [2].")] = None,
    phase_margin: Annotated[
        float | None, typer.Option(help="optimise: at least, degrees [pressure 45, position 35].")
    ] = None,
    peak_voltage: Annotated[float | None, typer.Option(help="optimise: at most, V.")] = None,
    ise: Annotated[float | None, typer.Option(help="optimise: weight of the squared error [1].")] = None,
    itae: Annotated[float | None, typer.Option(help="optimise: weight of time times error [1].")] = None,
    hold: Annotated[float | None, typer.Option(help="optimise: weight of the index under load [1].")] = None,
    voltage_use: Annotated[float | None, typer.Option(help="optimise: weight of voltage changes [0.02].")] = None,
    evaluations: Annotated[int, typer.Option(min=20, help="optimise: simulations at most.")] = 500,
    on: Annotated[Place, typer.Option(help="relay: model, virtual rig, or the station's graph.")] = Place.MODEL,
    rig: Annotated[str, typer.Option(help="relay: virtual rig, by path or name.")] = "paper",
    backend: Annotated[str, typer.Option(help="relay on the station: the bridge's backend.")] = "virtual",
    backend_options: Annotated[str, typer.Option(help="Its options in YAML [virtual: {rig: RIG}].")] = "",
    pace: Annotated[str, typer.Option(help="relay on the station: lockstep or realtime.")] = "lockstep",
    amplitude: Annotated[float | None, typer.Option(help="relay: V.")] = None,
    bias: Annotated[float | None, typer.Option(help="relay: V.")] = None,
    lowest: Annotated[float | None, typer.Option(help="relay: limit of the measured quantity, SI.")] = None,
    highest: Annotated[float | None, typer.Option(help="relay: limit of the measured quantity, SI.")] = None,
    name: Annotated[str, typer.Option(help="Name of the tuned controller.")] = "",
    out: OutOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Tune a controller: optimised on the nonlinear loop, by Ziegler and Nichols from the model, or by a relay.

    Prints the continuous and the discrete form as in the paper's Table 1, figures on the simulated loop, and margins.
    Leaves controller.yaml, which run and set take, and tuning.json.

    Example: dt-station tune pressure --method optimise --phase-margin 60
    """
    from ..core.channels import Channel
    from ..identification import tuning
    from . import tune_report
    from .simulate import check_stable

    channel = Channel(loop.value)
    spec, _ = load_model(model)
    if channel not in spec.paths:
        raise UserError(f"model {spec.name} has no {channel.value} path; choose another with --model.")
    check_stable(spec, model)
    usual = _FUZZY.get(loop.value, "") if mode == "fuzzy" else ""
    start = _with_mode(_controller(controller or usual or _USUAL[loop.value]), mode)
    other = _controller(_USUAL["position" if channel is Channel.PRESSURE else "pressure"])
    if not 1e-4 <= sample_time <= 1.0:
        raise UserError(f"--sample-time {sample_time:g}: give seconds from 0.0001 to 1.")
    experiment = tuning.usual_experiment(spec, channel, other, sample_time)
    scale = tuning.error_scale(start)
    point: UltimatePoint | None = None
    notes: list[str] = []
    if method is Method.OPTIMISE:
        given = {
            "overshoot_percent": overshoot, "gain_margin": gain_margin, "phase_margin_deg": phase_margin,
            "peak_v": peak_voltage, "ise": ise, "itae": itae, "hold": hold, "travel": voltage_use,
        }  # fmt: skip
        before, after, notes = _optimised(start, experiment, given, scale, evaluations)
    else:
        before = experiment.trial(start, scale)
        if method is Method.ZIEGLER_NICHOLS:
            point = tuning.ultimate_point(spec, channel, sample_time, scale)
        elif method is Method.RELAY:
            from .tune_relay import Wish, relay_point

            wish = Wish(on.value, rig, backend, backend_options, pace, amplitude, bias, lowest, highest)
            point = relay_point(spec, channel, other, sample_time, scale, wish)
        after = before if point is None else experiment.trial(tuning.tuned(start, point, start.mode, scale), scale)
    tuned = after.config.changed(name=name or (f"{start.name}_tuned" if method is not Method.CHECK else start.name))
    if method is not Method.CHECK:
        tuned = tuned.changed(source=f"dt-station tune {loop.value} --method {method.value} on model {spec.name}")
    result = tune_report.result(spec.name, channel, sample_time, method.value, before, after, point, notes, tuned)
    folder = output_dir("tune", out, force)
    files = tune_report.write(folder, tuned, result)
    if json:
        emit_json({**result, "files": files})
    else:
        tune_report.show(result, files)


def _controller(name: str) -> "LoopConfig":
    from ..core.control import LoopConfig

    path = find_config("controllers", name)
    return LoopConfig.from_yaml(path.read_text(encoding="utf-8"), str(path))


def _with_mode(config: "LoopConfig", mode: str) -> "LoopConfig":
    from ..core.samples import ControlMode

    if not mode:
        if config.mode is ControlMode.MANUAL:
            raise UserError(f"controller {config.name} is in manual mode; name another with --mode.")
        return config
    names = {m.name.lower(): m for m in ControlMode if m is not ControlMode.MANUAL}
    if mode not in names:
        raise UserError(f"--mode {mode}: choose one of {', '.join(names)}.")
    return config.with_mode(names[mode])


def _optimised(
    start: "LoopConfig", experiment: "Experiment", given: dict[str, Any], scale: float, evaluations: int
) -> "tuple[Trial, Trial, list[str]]":
    from pydantic import ValidationError

    from ..identification import tuning
    from .common import progress

    usual = tuning.usual_goal(experiment.channel)
    try:
        goal = tuning.Goal.model_validate(
            {**usual.model_dump(), **{key: value for key, value in given.items() if value is not None}}
        )
    except ValidationError as error:
        first = error.errors()[0]
        raise UserError(f"the goal's {'.'.join(map(str, first['loc']))}: {first['msg']}.") from None
    # A pure fuzzy controller stays pure: an integrating term is the user's to ask for.
    pure = start.fuzzy is not None and start.fuzzy.integral_gain == 0.0
    frozen = frozenset({"integral_gain"}) if pure else frozenset()
    with progress("Simulating the loop", evaluations) as advance:
        found = tuning.optimise(
            start, experiment, goal, scale, evaluations, frozen=frozen, progress=lambda _: advance()
        )
    notes = [f"{found.evaluations} simulations"]
    notes.extend(f"bound not met: {text}" for text in found.crossed)
    return found.before, found.after, notes
