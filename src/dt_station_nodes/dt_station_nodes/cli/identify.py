"""`dt-station identify`: a model from a run, with intervals and checks."""

import math
from enum import Enum
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
    progress,
)

if TYPE_CHECKING:
    from ..core.channels import Channel
    from ..core.run import Run
    from ..identification import IdentifiedPath


class What(str, Enum):
    """What to identify."""

    AUTO = "auto"
    DIRECT = "direct"
    CLOSED_LOOP = "closed-loop"
    DISTURBANCE = "disturbance"
    STATIC = "static"
    INVERSE_DYNAMICS = "inverse-dynamics"


_POSITION_ONLY = (What.DISTURBANCE, What.INVERSE_DYNAMICS)


class Channels(str, Enum):
    """Which channel to identify."""

    AUTO = "auto"
    PRESSURE = "pressure"
    POSITION = "position"


def identify(
    run: Annotated[Path, typer.Argument(help="A bag, the station's CSV, or foreign data with --map.")],
    *,
    data_map: Annotated[str, typer.Option("--map", help="Map of foreign columns, a path or a name.")] = "",
    channel: Annotated[Channels, typer.Option(help="Channel [auto: all whose voltage moves].")] = Channels.AUTO,
    method: Annotated[
        What, typer.Option(help="Way of identification; auto adds the paper's beside the direct one.")
    ] = What.AUTO,
    poles: Annotated[str, typer.Option(help="Numbers of poles to try: 2, 1-6 or 2,4,6.")] = "",
    zeros: Annotated[str, typer.Option(help="Numbers of zeros to try [all below the poles].")] = "",
    delay: Annotated[str, typer.Option(help="auto, none or seconds.")] = "auto",
    integrators: Annotated[
        int | None, typer.Option(min=0, max=2, help="Poles at zero [position 1, pressure 0].")
    ] = None,
    disturbance: Annotated[bool, typer.Option(help="Identify pressure -> position with the position path.")] = True,
    rest_pressure: Annotated[float | None, typer.Option(help="Pressure without load voltage, Pa.")] = None,
    scaling_gain: Annotated[
        float | None, typer.Option(help="closed-loop: proportional gain, V per cm [read off the run].")
    ] = None,
    lag: Annotated[
        float | None, typer.Option(help="static: lag of the linear path, s [that of --model, else 0].")
    ] = None,
    force_per_volt: Annotated[float, typer.Option(help="inverse-dynamics: force of one volt, N.")] = 1.0,
    model: Annotated[str, typer.Option(help="Model to take the other paths from and to compare with.")] = "",
    validate: Annotated[Path | None, typer.Option(help="Another run, to judge the model on.")] = None,
    validate_map: Annotated[str, typer.Option("--validate-map", help="Its map [that of --map].")] = "",
    name: Annotated[str, typer.Option(help="Name of the model.")] = "identified",
    out: OutOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
) -> None:
    """Estimate a model from a run: candidates, the chosen one with 95 % intervals, residual tests, pictures.

    Leaves model.yaml (the twin loads it), identification.json and pictures.

    Example: dt-station identify runs/experiment-1/run.csv --channel pressure --poles 1-6
    """
    from ..records import load_run
    from . import identify_report as report

    if rest_pressure is not None and not math.isfinite(rest_pressure):
        raise UserError(f"--rest-pressure {rest_pressure}: give a number of Pa.")
    mapped = find_config("maps", data_map) if data_map else None
    checked = find_config("maps", validate_map) if validate_map else mapped
    data = load_run(run, mapped)
    check = load_run(validate, checked) if validate is not None else None
    base = load_model(model)[0] if model else None
    channels = _channels(data, Channels.POSITION if method in _POSITION_ONLY else channel)
    with progress(f"Identifying from {run}") as advance:
        if method is What.INVERSE_DYNAMICS:
            outcome = report.axis(data, check, force_per_volt, name)
        elif method is What.STATIC:
            outcome = report.static(data, channels, lag, base, name)
        else:
            paths: list[IdentifiedPath] = []
            for one in channels:
                paths += _paths(
                    data,
                    one,
                    method,
                    poles,
                    zeros,
                    delay,
                    integrators,
                    disturbance,
                    rest_pressure,
                    scaling_gain,
                    paths,
                    advance,
                )
            outcome = report.paths(data, paths, check, base, name)
    folder = output_dir("identify", out, force)
    outcome.write(folder)
    if json:
        emit_json({**outcome.summary, "files": str(folder)})
    else:
        outcome.show()
        console.print(f"Model, intervals and pictures are in {folder}")


def numbers(text: str, what: str) -> tuple[int, ...] | None:
    """Numbers written 2, 1-6 or 2,4,6; None where nothing is written."""
    if not text.strip():
        return None
    found: list[int] = []
    try:
        for part in text.split(","):
            low, _, high = part.partition("-")
            found += range(int(low), int(high or low) + 1)
    except ValueError:
        raise UserError(f"--{what} {text}: write numbers as 2, 1-6 or 2,4,6.") from None
    if not found or min(found) < 0 or max(found) > 12:
        raise UserError(f"--{what} {text}: the numbers must lie between 0 and 12.")
    return tuple(found)


def _channels(data: "Run", wanted: Channels) -> "tuple[Channel, ...]":
    from ..core.channels import Channel

    if wanted is not Channels.AUTO:
        return (Channel(wanted.value),)
    moving = tuple(c for c in data.channels() if _moves(data, c.voltage_signal))
    if not moving:
        raise UserError(
            f"{data.source}: no channel has both a moving voltage and a measured output, so nothing can be identified; "
            "excite a valve and record again."
        )
    return moving


def _moves(data: "Run", signal: str) -> bool:
    values = data.get(signal)
    return values is not None and bool((values != values[0]).any())


def _delay(text: str) -> float | None:
    if text == "auto":
        return None
    if text == "none":
        return 0.0
    try:
        return float(text)
    except ValueError:
        raise UserError(f"--delay {text}: write auto, none or seconds.") from None


def _paths(
    data: "Run",
    channel: "Channel",
    method: What,
    poles: str,
    zeros: str,
    delay: str,
    integrators: int | None,
    disturbance: bool,
    rest_pressure: float | None,
    scaling_gain: float | None,
    before: "list[IdentifiedPath]",
    advance: Any,
) -> "list[IdentifiedPath]":
    """The chosen path first; the paper's way beside it where the run allows it."""
    import numpy as np

    from ..core.channels import Channel
    from ..identification import (
        IdentificationError,
        identify_closed_loop,
        identify_direct,
        identify_disturbance,
        orders,
    )

    if method is What.CLOSED_LOOP:
        return [identify_closed_loop(data, channel, scaling_gain)]
    rest: float | None = None
    # only a pressure that the load valve moves is an input; otherwise the piston's own motion moves it
    if channel is Channel.POSITION and disturbance and _moves(data, Channel.PRESSURE.voltage_signal):
        pressure = data.get(Channel.PRESSURE.signal)
        known = [p.rest for p in before if p.channel is Channel.PRESSURE]
        if rest_pressure is not None:
            rest = rest_pressure
        elif pressure is not None:
            rest = (known or [float(np.quantile(pressure, 0.01))])[0]
    if method is What.DISTURBANCE or (rest is not None and not _moves(data, channel.voltage_signal)):
        if rest is None:
            raise UserError(f"{data.source}: the load voltage does not move, so no disturbance path can be identified.")
        wanted = numbers(poles, "poles")
        grid = ((3, 1),) if wanted is None else orders(wanted, numbers(zeros, "zeros"))
        return [identify_disturbance(data, rest, grid, 1 if integrators is None else integrators)]
    found = [
        identify_direct(
            data,
            channel,
            numbers(poles, "poles"),
            numbers(zeros, "zeros"),
            integrators,
            _delay(delay),
            rest,
            advance=lambda text: advance(1, f"{channel.value}: {text}"),
        )
    ]
    if method is What.AUTO and channel is Channel.POSITION and _moves(data, channel.setpoint_signal):
        try:
            found.append(identify_closed_loop(data, channel, scaling_gain))
        except IdentificationError as error:
            console.print(f"The paper's closed-loop way is left out: {error}", soft_wrap=True)
    return found
