"""Waveforms as people type them on the command line."""

from ..core.units import parse_quantity
from ..core.waveforms import Shape, Waveform
from .common import UserError

_FIELDS = {
    "amplitude": ("amplitude", None),
    "offset": ("offset", None),
    "value": ("offset", None),
    "frequency": ("frequency_hz", "frequency"),
    "phase": ("phase_rad", "angle"),
    "duty": ("duty", "ratio"),
}


def parse_waveform(text: str, dimension: str) -> Waveform:
    """A waveform as typed: a plain quantity, or SHAPE,name=quantity,... Raises UserError."""
    shape_text, *parts = [part.strip() for part in text.split(",")]
    shapes = {shape.name.lower(): shape for shape in Shape}
    if shape_text not in shapes:
        if parts:
            raise UserError(f"{text!r}: no waveform is called {shape_text!r}; there are {', '.join(shapes)}.")
        return Waveform(Shape.CONSTANT, offset=parse_quantity(shape_text, dimension))
    shape = shapes[shape_text]
    values: dict[str, float] = {"duty": shape.usual_duty}
    for part in parts:
        key, equals, quantity = part.partition("=")
        if not equals or key not in _FIELDS:
            raise UserError(f"{text!r}: write each part as one of {', '.join(_FIELDS)} = quantity, not {part!r}.")
        name, own = _FIELDS[key]
        values[name] = parse_quantity(quantity, own or dimension)
    return Waveform(shape, **values)
