"""Periodic disturbance: something outside the model shakes the output at one frequency or two, always or in bursts.

What pushes one way only, as a pump's pistons do, is a half sine in each period. A machine whose speed goes up and down
slowly modulates its frequency. A switching supply's has edges: a trapezoid, of which a sawtooth, a square wave and
pulses are ends.
"""

import math

from ..compiled import SUBSTEP, TIME, Doubles, effect_step
from .effect import Attachment, Effect, Parameter, Quantity, on_both

_NARROWEST = 0.02  # of a period: a shorter push is none
_STEEPEST = 0.0005  # of a period: a quicker edge is none that samples tell
_EDGE = 0.02  # of a period of bursts: what it takes to come on, and to go off


@effect_step
def _step(p: Doubles, s: Doubles, value: float, c: Doubles) -> float:
    angle = 2.0 * math.pi * p[1] * (c[TIME] + c[SUBSTEP]) + p[2]
    if p[17] != 0.0:
        angle += p[17] * math.sin(2.0 * math.pi * p[18] * (c[TIME] + c[SUBSTEP]) + p[19])
    sine = math.sin(angle)
    wave = sine
    if p[3] != 0.0 or p[4] != 0.0 or p[5] != 0.0 or p[6] != 0.0:
        cosine = math.cos(angle)
        twice = 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
        wave += p[3] * twice[0] + p[4] * twice[1]
        wave += p[5] * (twice[0] * cosine + twice[1] * sine) + p[6] * (twice[1] * cosine - twice[0] * sine)
    if abs(p[16]) >= _NARROWEST:
        crest = 0.25 if p[16] > 0.0 else 0.75
        since = (angle / (2.0 * math.pi) - crest + 0.5 * abs(p[16])) % 1.0
        wave = math.copysign(math.sin(math.pi * since / abs(p[16])), p[16]) if since < abs(p[16]) else 0.0
    if p[20] > 0.0:
        rise, high, fall = max(p[20], _STEEPEST), p[21], max(p[22], _STEEPEST)
        whole = max(rise + high + fall, 1.0)
        rise, high, fall = rise / whole, high / whole, fall / whole
        # Its first harmonic is the plain sine, whatever its form: the phase of what rises less that of what falls.
        between = 2.0 * math.pi * (0.5 * rise + high + 0.5 * fall)
        up, down = math.sin(math.pi * rise) / rise, math.sin(math.pi * fall) / fall
        first = math.atan2(down * math.cos(between) - up, down * math.sin(between))
        since = (angle / (2.0 * math.pi) - 0.25 - first / (2.0 * math.pi) + 0.5 * rise) % 1.0
        level = min(2.0 * since / rise, 2.0, max(2.0 * (rise + high + fall - since) / fall, 0.0))
        wave = level - (rise + 2.0 * high + fall)
    if p[7] > 0.0:
        into = ((c[TIME] + c[SUBSTEP] - p[9]) / p[7]) % 1.0
        middle = abs(into - 0.5 * p[8])
        away = min(middle, 1.0 - middle) - 0.5 * p[8]
        wave *= min(max(0.5 - away / _EDGE, 0.0), 1.0)
    if p[13] != 0.0:
        wave *= 1.0 + p[13] * math.sin(2.0 * math.pi * p[14] * (c[TIME] + c[SUBSTEP]) + p[15])
    if p[10] != 0.0:
        wave += p[10] * math.sin(2.0 * math.pi * p[11] * (c[TIME] + c[SUBSTEP]) + p[12])
    return value + p[0] * wave


EFFECT = Effect(
    name="periodic_disturbance",
    sentence="The output carries an oscillation of one or two frequencies that no input explains.",
    attachment=Attachment.OUTPUT,
    parameters=(
        Parameter("amplitude", Quantity.SIGNAL, "amplitude of the oscillation", 0.0, 2.0, (0.05,)),
        Parameter("frequency_hz", Quantity.FREQUENCY, "its frequency", 0.02, 24.0, (0.5, 2.0, 8.0), acts_alone=False),
        Parameter(
            "phase_rad",
            Quantity.ANGLE,
            "its phase at the start of the run",
            -7.0,
            7.0,
            (0.0, 2.0, -2.0),
            acts_alone=False,
        ),
        Parameter("second_sine", Quantity.RATIO, "second harmonic in phase", -1.5, 1.5, (0.0,), optional=True),
        Parameter("second_cosine", Quantity.RATIO, "second harmonic a quarter off", -1.5, 1.5, (0.0,), optional=True),
        Parameter("third_sine", Quantity.RATIO, "third harmonic in phase", -1.5, 1.5, (0.0,), optional=True),
        Parameter("third_cosine", Quantity.RATIO, "third harmonic a quarter off", -1.5, 1.5, (0.0,), optional=True),
        Parameter(
            "burst_period_s",
            Quantity.RUN_TIME,
            "period with which it comes and goes, 0 where it is always there",
            0.4,
            240.0,
            (),
            optional=True,
        ),
        Parameter("burst_share", Quantity.RATIO, "share of that period in which it is there", 0.02, 1.0, (), 1.0, True),
        Parameter(
            "burst_start_s", Quantity.RUN_TIME, "time of the run at which it first comes", -240.0, 240.0, (), 0.0, True
        ),
        Parameter("second_share", Quantity.RATIO, "amplitude of a second tone, of the first", 0.0, 1.5, (), 0.0, True),
        Parameter("second_hz", Quantity.FREQUENCY, "its frequency", 0.02, 24.0, (), 0.0, True),
        Parameter("second_rad", Quantity.ANGLE, "its phase at the start of the run", -7.0, 7.0, (), 0.0, True),
        Parameter("swell", Quantity.RATIO, "share by which the oscillation swells and sinks", 0.0, 1.5, (), 0.0, True),
        Parameter("swell_hz", Quantity.FREQUENCY, "how often it does", 0.02, 24.0, (), 0.0, True),
        Parameter("swell_rad", Quantity.ANGLE, "its phase at the start of the run", -7.0, 7.0, (), 0.0, True),
        Parameter(
            "push_share",
            Quantity.RATIO,
            "share of each period in which it pushes, one way only (its sign); 0 where it swings both ways",
            -0.7,
            0.7,
            (0.25, 0.5, -0.25, -0.5),
            optional=True,
            apart=True,
        ),
        Parameter(
            "modulation_rad",
            Quantity.ANGLE,
            "by how much its phase swings as its frequency goes up and down: the modulation index",
            0.0,
            12.0,
            (),
            optional=True,
        ),
        Parameter("modulation_hz", Quantity.FREQUENCY, "how often it does", 0.005, 5.0, (), 0.0, True),
        Parameter(
            "modulation_phase_rad", Quantity.ANGLE, "its phase at the start of the run", -7.0, 7.0, (), 0.0, True
        ),
        Parameter(
            "rise_share",
            Quantity.RATIO,
            "share of each period in which it rises along a line, where it has edges; 0: it has none",
            0.0,
            1.0,
            (),
            optional=True,
        ),
        Parameter("high_share", Quantity.RATIO, "share in which it then stays high", 0.0, 1.0, (), 0.0, True),
        Parameter("fall_share", Quantity.RATIO, "share in which it falls again", 0.0, 1.0, (), 0.0, True),
    ),
    step=_step,
    check="Look for pump ripple, mains hum or a neighbouring machine at this frequency; log with the valve unpowered.",
    source="additive sinusoid; modulated: Randall, Vibration-based Condition Monitoring (2011), 2.2",
    also=on_both(Attachment.INPUT),
    apart_at=Attachment.INPUT,
)
