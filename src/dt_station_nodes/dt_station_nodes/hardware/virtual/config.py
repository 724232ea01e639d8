"""What a virtual rig is made of: frozen, validated, in SI, one section a part; an imperfection left out is absent."""

from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator


def _number(value: object) -> object:
    # YAML 1.1 reads 1e6 as a string, and a person writes just that.
    if isinstance(value, str):
        return float(value)
    return value


Number = Annotated[float, BeforeValidator(_number)]
Positive = Annotated[float, BeforeValidator(_number), Field(gt=0.0)]
NonNegative = Annotated[float, BeforeValidator(_number), Field(ge=0.0)]


class Part(BaseModel):
    """Base of all sections."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Oil(Part):
    """Compressibility of the oil and the air carried in it."""

    bulk_modulus_pa: Positive = 1.2e9
    air_fraction: Annotated[float, Field(ge=1e-5, le=0.05)] = 0.004


class Cylinder(Part):
    """A differential cylinder; dead volumes include the hoses up to the valve."""

    piston_diameter_m: Positive
    rod_diameter_m: Positive
    stroke_m: Positive
    cap_dead_volume_m3: Positive = 2.0e-4
    rod_dead_volume_m3: Positive = 2.0e-4

    @model_validator(mode="after")
    def _rod_fits(self) -> "Cylinder":
        if self.rod_diameter_m >= self.piston_diameter_m:
            raise ValueError("rod_diameter_m must be less than piston_diameter_m")
        return self


class Axis(Part):
    """The common axis of both cylinders."""

    moving_mass_kg: Positive = 35.0
    viscous_friction_n_s_m: NonNegative = 900.0
    start_position_m: Number = 0.0
    stop_stiffness_n_m: Positive = 2.0e8


class Friction(Part):
    """LuGre friction of the seals (Canudas de Wit et al. 1995)."""

    coulomb_n: NonNegative
    static_n: NonNegative
    stribeck_velocity_m_s: Positive = 0.01
    bristle_stiffness_n_m: Positive = 5.0e6
    bristle_damping_n_s_m: NonNegative = 2.0e3

    @model_validator(mode="after")
    def _static_is_larger(self) -> "Friction":
        if self.static_n < self.coulomb_n:
            raise ValueError("static_n must not be less than coulomb_n")
        return self


class Frame(Part):
    """The frame and mountings give way under the load, slowly and damped."""

    compliance_m_n: NonNegative
    natural_frequency_rad_s: Positive
    damping_ratio: Positive


class ServoValve(Part):
    """Four-way servo valve with its amplifier; openings are counted in volts of command."""

    rated_flow_m3_s: Positive
    rated_drop_pa: Positive = 3.5e6
    rated_voltage_v: Positive = 10.0
    overlap_v: Number = 0.0
    rounding_v: Positive = 0.03
    null_shift_v_pa: Number = 0.0
    spool_frequency_rad_s: Positive = 250.0
    spool_damping_ratio: Positive = 0.9
    amplifier_lag_s: Positive = 0.0015
    amplifier_limit_v: Positive = 10.0
    delay_s: NonNegative = 0.0
    piston_leakage_m3_s_pa: NonNegative = 0.0
    supply_pressure_pa: Positive = 11.6e6


class Hysteresis(Part):
    """Magnetic hysteresis of the solenoid, a Preisach model: hysterons of log-normal half-width, denser at mid range.

    `half_width_v` is half the loop's width at mid range; at either end of the range it is less by `end_share`.
    """

    half_width_v: NonNegative
    spread: Annotated[float, Field(ge=0.0, le=1.0)] = 0.3
    end_share: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.4


class ReliefValve(Part):
    """Proportional relief valve with its amplifier, fed by the load pump through a check valve."""

    rest_pressure_pa: Positive = 1.0e6
    gain_pa_v: Positive = 1.0e6
    opening_v: NonNegative = 0.0
    rounding_v: Positive = 0.01
    override_pa_s_m3: Positive = 5.0e8
    armature_frequency_rad_s: Positive = 45.0
    armature_damping_ratio: Positive = 0.75
    flux_lag_s: Positive = 0.03
    amplifier_lag_s: Positive = 0.003
    amplifier_limit_v: Positive = 5.0
    delay_s: NonNegative = 0.0
    hysteresis: Hysteresis | None = None
    pump_flow_m3_s: Positive = 3.0e-4
    pump_slip_m3_s_pa: NonNegative = 0.0
    pump_limit_pa: Positive = 16.0e6


class Sensor(Part):
    """A transducer on the card's input: its range (SI) is mapped on all the converter's steps."""

    low: Number
    high: Number
    lag_s: Positive = 0.001
    noise_rms: NonNegative = 0.0
    bits: Annotated[int, Field(ge=0, le=32)] = 16

    @model_validator(mode="after")
    def _ordered(self) -> "Sensor":
        if self.low >= self.high:
            raise ValueError("low must be less than high")
        return self


class AnalogOutput(Part):
    """A voltage output of the card; 0 bits means not quantised."""

    low_v: Number
    high_v: Number
    bits: Annotated[int, Field(ge=0, le=32)] = 16

    @model_validator(mode="after")
    def _ordered(self) -> "AnalogOutput":
        if self.low_v >= self.high_v:
            raise ValueError("low_v must be less than high_v")
        return self


class RigConfig(Part):
    """A whole virtual rig."""

    name: str
    source: str = ""
    seed: Annotated[int, Field(ge=0, lt=2**53)] = 1
    longest_substep_s: Annotated[float, BeforeValidator(_number), Field(ge=1e-6, le=5e-5)] = 2.0e-5
    oil: Oil = Oil()
    tested_cylinder: Cylinder
    load_cylinder: Cylinder
    axis: Axis = Axis()
    friction: Friction | None = None
    frame: Frame | None = None
    servo_valve: ServoValve
    relief_valve: ReliefValve
    pressure_sensor: Sensor
    position_sensor: Sensor
    load_output: AnalogOutput
    servo_output: AnalogOutput

    @model_validator(mode="after")
    def _starts_inside(self) -> "RigConfig":
        stroke = min(self.tested_cylinder.stroke_m, self.load_cylinder.stroke_m)
        if abs(self.axis.start_position_m) > stroke / 2:
            raise ValueError(f"axis.start_position_m must lie within half the stroke, -{stroke / 2} to {stroke / 2} m")
        if self.relief_valve.rest_pressure_pa <= self.relief_valve.override_pa_s_m3 * self.relief_valve.pump_flow_m3_s:
            raise ValueError("relief_valve.override_pa_s_m3 times the pump's flow must stay below rest_pressure_pa")
        return self
