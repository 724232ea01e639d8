"""`dt-station set`: change a set-point waveform or a controller of the running station."""

from typing import Annotated, Any

import typer

from .common import JsonOption, UserError, emit_json

_DIMENSION = {"load": "pressure", "position": "length"}


def set(
    channel: Annotated[str, typer.Argument(help="load or position.")],
    *,
    shape: Annotated[str | None, typer.Option(help="constant, sine, square, triangle or sawtooth.")] = None,
    amplitude: Annotated[str | None, typer.Option(help="Half of peak to peak, such as 2MPa or 3cm.")] = None,
    offset: Annotated[str | None, typer.Option(help="Middle of the waveform.")] = None,
    frequency: Annotated[str | None, typer.Option(help="Such as 0.5Hz.")] = None,
    phase: Annotated[str | None, typer.Option(help="Such as 90deg; added to the running phase.")] = None,
    duty: Annotated[str | None, typer.Option(help="Share of the period spent high or rising, such as 30%.")] = None,
    value: Annotated[str | None, typer.Option(help="A constant set-point: --shape constant --offset VALUE.")] = None,
    off: Annotated[bool, typer.Option("--off", help="Silence the generator; the last value stands.")] = False,
    on: Annotated[bool, typer.Option("--on", help="Have the generator play again.")] = False,
    controller: Annotated[str | None, typer.Option(help="manual, pi, pid or fuzzy; bumpless.")] = None,
    voltage: Annotated[str | None, typer.Option(help="The voltage of manual mode, such as 1.5V.")] = None,
    wait: Annotated[float, typer.Option(help="How long to look for the running station, s.")] = 10.0,
    json: JsonOption = False,
) -> None:
    """Change what the running station does; what is not named stays as it is.

    Examples: dt-station set load --shape sine --amplitude 2MPa --frequency 0.5Hz

    dt-station set position --controller fuzzy
    """
    from ..nodes import remote

    if channel not in _DIMENSION:
        raise UserError(f"the channel is load or position, not {channel!r}.")
    waveform = _waveform(channel, shape, amplitude, offset, frequency, phase, duty, value)
    loop = _loop(controller, voltage)
    if off and (on or waveform):
        raise UserError("--off goes with no waveform and not with --on.")
    if not (waveform or loop or off or on):
        raise UserError("nothing to set; name at least one option, such as --shape sine.")
    with remote.Remote(wait) as station:
        changed: dict[str, Any] = {}
        if waveform:
            changed["waveform"] = station.set_waveform(channel, waveform)
        if off or on:
            changed["generator"] = station.set_parameters(station.generator(channel), {"enabled": on})
        if loop:
            changed["controller"] = station.set_controller(channel, loop)
    if json:
        emit_json({"channel": channel, **changed})
        return
    for what, values in changed.items():
        print(f"{channel} {what}: " + ", ".join(f"{name} {_short(each)}" for name, each in values.items()))


def _waveform(channel: str, shape: str | None, *texts: str | None) -> dict[str, Any]:
    from ..core.units import parse_quantity

    *parts, value = texts
    names = ("amplitude", "offset", "frequency_hz", "phase_rad", "duty")
    own = _DIMENSION[channel]
    dimensions = (own, own, "frequency", "angle", "ratio")
    changes: dict[str, Any] = {
        name: parse_quantity(text, dimension)
        for name, text, dimension in zip(names, parts, dimensions, strict=True)
        if text is not None
    }
    if shape is not None:
        changes["shape"] = shape
    if value is not None:
        if changes:
            raise UserError("--value is a constant; it goes with no other part of a waveform.")
        changes = {"shape": "constant", "offset": parse_quantity(value, own)}
    return changes


def _loop(controller: str | None, voltage: str | None) -> dict[str, Any]:
    from ..core.units import parse_quantity

    loop: dict[str, Any] = {}
    if controller is not None:
        loop["mode"] = controller
    if voltage is not None:
        loop["manual_voltage_v"] = parse_quantity(voltage, "voltage")
    return loop


def _short(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
