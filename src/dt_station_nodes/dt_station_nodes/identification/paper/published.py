"""The figures Ćwikła and Szewczyk print: Electronics 2024, 13(17), 3528, doi:10.3390/electronics13173528."""

from types import MappingProxyType

SOURCE = "Ćwikła & Szewczyk, Electronics 2024, 13(17), 3528"

SETTLING_S = MappingProxyType({"pressure_pi": 0.5, "pressure_pi_zn": 1.0})
SIMULATED_GAIN_S = 0.5  # Z-N takes "approx. 0.5 s" longer in simulation

# Table 1 as printed: Kr and Ki of (Kr s + Ki)/s, a and b of (a z - b)/(z - 1).
TABLE_1 = MappingProxyType(
    {
        "pressure_pi_zn": ("0.459", "3.456", "0.459", "0.3899"),
        "pressure_pi": ("0.2861", "6.33", "0.2861", "0.1595"),
    }
)
ZIEGLER_NICHOLS = (0.4590, 0.1328)  # Kr, Ti

INDEX = MappingProxyType({"pid": 1.3031, "fuzzy": 1.8612})
INDEX_RATIO = INDEX["fuzzy"] / INDEX["pid"]

REST_MPA = 1.0
# From the printed transfer functions (1), (5), (6) by hand: quotients of their coefficients.
PRESSURE_GAIN = 3.217e10 / 3.242e10
SERVO_GAIN_CM_S_V = 206.4 / 23.34
SERVO_LAG_S = 1.0 / 23.34
DRIFT_CM_S_MPA = -16.45 / 2009.0
DISTURBANCE = ((64.72, -16.45), (1.0, 76.54, 2009.0, 0.0))
UNSTABLE_POLE = 1.000013  # of (7) with the printed settings on (5) at 20 ms
