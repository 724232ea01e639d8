"""The card's converters and the sensors' noise: pure functions of value, seed and sample number."""

from math import cos, log, pi, sqrt

from .config import AnalogOutput, Sensor

_MASK = (1 << 64) - 1


def quantised(value: float, low: float, high: float, bits: int) -> float:
    """The nearest of the 2**bits codes from low to one step below high; only clipped at 0 bits.

    Codes are counted so that a range symmetric about zero has a code for zero.
    """
    if bits == 0:
        return min(max(value, low), high)
    step = (high - low) / (1 << bits)
    code = min(max(round((value - low) / step), 0), (1 << bits) - 1)
    return low + code * step


def driven(output: AnalogOutput, voltage_v: float) -> tuple[float, bool]:
    """What the output really gives (V), and whether its range cut the voltage."""
    return quantised(
        voltage_v, output.low_v, output.high_v, output.bits
    ), not output.low_v <= voltage_v <= output.high_v


def sensed(sensor: Sensor, value: float, seed: int, stream: int, sequence: int) -> tuple[float, bool]:
    """What the card reads of a value (SI), with noise, and whether it is out of the sensor's range."""
    noisy = value + sensor.noise_rms * normal(seed, stream, sequence) if sensor.noise_rms > 0.0 else value
    return quantised(noisy, sensor.low, sensor.high, sensor.bits), not sensor.low <= noisy <= sensor.high


def normal(seed: int, stream: int, sequence: int) -> float:
    """A standard normal number of a stream at a sample: counter-based, so a state needs no generator (Box-Muller)."""
    first = _scramble(_scramble(_scramble(seed) ^ stream) ^ sequence)
    second = _scramble(first)
    uniform = ((first >> 11) + 1) / (1 << 53)
    angle = 2.0 * pi * (second >> 11) / (1 << 53)
    return sqrt(-2.0 * log(uniform)) * cos(angle)


def _scramble(value: int) -> int:
    # SplitMix64 (Steele, Lea & Flood 2014).
    value = (value + 0x9E3779B97F4A7C15) & _MASK
    value = ((value ^ (value >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    value = ((value ^ (value >> 27)) * 0x94D049BB133111EB) & _MASK
    return value ^ (value >> 31)
