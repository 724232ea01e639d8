"""What an effect is: one physical thing a model has or lacks, with its parameters and its compiled step."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from ...channels import Channel


class Attachment(str, Enum):
    """Where an effect sits in a path."""

    INPUT = "input"  # on the voltage, before the linear path
    STATE = "state"  # inside it: knows output, velocity and load; changes the voltage or injects a flow
    OUTPUT = "output"  # on the measured quantity


class Quantity(Enum):
    """What a parameter measures; discovery scales its starts and bounds by the run's own range of it."""

    RATIO = "1"
    INPUT = "V"
    INPUT_PEAK = "V, of the highest"
    INPUT_RATE = "V/s"
    OUTPUT = "output"
    SIGNAL = "signal"  # V where the effect sits on the input, else as OUTPUT
    PER_SIGNAL = "1/signal"
    PER_SIGNAL_SQUARED = "1/signal^2"
    VELOCITY = "output/s"
    ACCELERATION = "output/s^2"
    TIME = "s"
    RUN_TIME = "s, of the run"
    RATE = "1/s"
    RUN_RATE = "1/s, of the run"
    FREQUENCY = "Hz"
    ANGLE = "rad"
    PER_OUTPUT = "1/output"
    PER_OUTPUT_SQUARED = "1/output^2"
    PER_OUTPUT_CUBED = "1/output^3"
    PER_LOAD = "1/Pa"
    VELOCITY_PER_LOAD = "output/(s Pa)"
    INPUT_PER_OUTPUT = "V/output"
    INPUT_PER_VELOCITY_SQUARED = "V s^2/output^2"
    INPUT_PER_OUTPUT_CUBED = "V/output^3"


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of an effect.

    `lower`, `upper` and `starts` are multiples of the run's scale of `quantity` (1 for ratios and radians, and for
    times, rates and hertz where path and run are about as fast and as long as a servo valve's); `neutral` is the
    value, in the parameter's own unit, at which it changes nothing. An `optional` parameter refines the form and
    stays neutral unless a model sets it or a fit frees it. The effect is present where a parameter that `acts_alone`
    (None: every one that is not optional) is off its neutral value. One `tried_first` is optional in a model, but a
    fit frees it from the start, `first_on` some channels only; one without `starts` is tried where the run itself shows
    where to begin; one `apart` makes a form of its own, to which no fit finds the way from the plain one; with the
    starts 0 and 1, each does. `usual` values are a choice of form, no measured number: a fit that ends near one is
    tried there. What a parameter changes may come in stairs: less than its `grain` shows in no sample, so its fit
    begins from finer starts and takes slopes over that, on the channels `in_stairs`. It means something on its
    `channels` only and, given a place `at`, only there.
    """

    name: str
    quantity: Quantity
    meaning: str
    lower: float
    upper: float
    starts: tuple[float, ...]
    neutral: float = 0.0
    optional: bool = False
    acts_alone: bool | None = None
    tried_first: bool = False
    first_on: tuple[Channel, ...] = ()
    apart: bool = False
    usual: tuple[float, ...] = ()
    grain: float = 0.0
    in_stairs: tuple[Channel, ...] = (Channel.PRESSURE, Channel.POSITION)
    channels: tuple[Channel, ...] = (Channel.PRESSURE, Channel.POSITION)
    at: Attachment | None = None

    def grain_on(self, channel: Channel) -> float:
        """Its grain on a channel."""
        return self.grain if channel in self.in_stairs else 0.0

    @property
    def shows_presence(self) -> bool:
        """Whether it being off its neutral value means that the effect is there."""
        return not self.optional if self.acts_alone is None else self.acts_alone

    def unit(self, channel: Channel, at: "Attachment | None" = None) -> str:
        """Unit on a channel, with the channel's own unit in place of `output`."""
        own = "V" if at is Attachment.INPUT else channel.unit
        return self.quantity.value.partition(",")[0].replace("signal", own).replace("output", channel.unit)


# Of what moves towards zero otherwise than away from it (`sided`).
PAST_ZERO = Parameter(
    "past_zero",
    Quantity.RATIO,
    "1: a move through zero that ends further out counts as away from it from its start, 0: from zero on",
    0.0,
    1.0,
    (1.0,),
    optional=True,
    usual=(1.0,),
)


def begins(quantity: Quantity) -> Parameter:
    """Of what remembers: as if it had come from so far off what it is first given, in the middle of its loop or gap."""
    meaning = "how far from rest it was last in its middle before the run, whose start may find it anywhere"
    return Parameter("begins", quantity, meaning, -1.5, 1.5, (), optional=True)


def on_both(*places: Attachment) -> dict[Channel, tuple[Attachment, ...]]:
    """The same places on either channel."""
    return dict.fromkeys(Channel, places)


@dataclass(frozen=True, slots=True)
class Effect:
    """One effect of the library.

    `step` is a C function made by `effect_step`; its parameters come in the order of `parameters`, its state is
    `state_size` zeros at the start. `sub_stepped` effects are dynamic and need sub-steps within a sample; those that
    `hold` give the same as long as the voltage before them is the same, but where the parameter that they are
    `moved_by` is not 0: then they are dynamic too. An effect inside a static path feeds its output back, which
    sub-steps must resolve, unless it `only_paces`: what is fed back sets how quick it is. One that does nothing
    `between` two places of the output, parameters of it, needs an integrating path to be where it was measured.
    On the channels that it `feels_all_on`, it answers to all else inside the path, whatever the model lists after it.

    `also` lists the places other than `attachment` where a model may put it and discovery tries it, by channel;
    `apart_at` is the one of its form apart (None: the usual one). Effects outside the `vocabulary` are never named by
    discovery: they stand for behaviour that must not be mistaken for a named effect. Those that they are at one end of
    their range are their `special_cases`, each with the parameter that makes them so ("": they always are).
    `names` are its parameters', in their order.
    """

    name: str
    sentence: str
    attachment: Attachment
    parameters: tuple[Parameter, ...]
    step: Any
    check: str
    source: str
    channels: tuple[Channel, ...] = (Channel.PRESSURE, Channel.POSITION)
    state_size: int = 0
    sub_stepped: bool = False
    holds: bool = False
    moved_by: str = ""
    only_paces: bool = False
    feels_all_on: tuple[Channel, ...] = ()
    between: tuple[str, ...] = ()
    also: Mapping[Channel, tuple[Attachment, ...]] = field(default_factory=dict)
    apart_at: Attachment | None = None
    vocabulary: bool = True
    special_cases: Mapping[str, str] = field(default_factory=dict)
    names: tuple[str, ...] = field(init=False)
    _neutral: Mapping[str, float] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        neutral = {p.name: p.neutral for p in self.parameters}
        object.__setattr__(self, "names", tuple(neutral))
        object.__setattr__(self, "_neutral", neutral)

    def moves(self, parameters: Mapping[str, float]) -> bool:
        """Whether it is dynamic, with such parameters."""
        return self.sub_stepped or parameters.get(self.moved_by, 0.0) != 0.0

    def held(self, parameters: Mapping[str, float]) -> bool:
        """Whether, with such parameters, it gives the same as long as the voltage before it is the same."""
        return self.holds and not self.moves(parameters)

    def places(self, channel: Channel) -> tuple[Attachment, ...]:
        """Where it may sit on a channel, its usual place first."""
        return (self.attachment, *self.also.get(channel, ()))

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name; KeyError if there is none."""
        return {p.name: p for p in self.parameters}[name]

    def complete(self, given: dict[str, float]) -> dict[str, float]:
        """All parameters in order, absent optional ones at their neutral value; ValueError on a missing one."""
        whole = {**self._neutral, **given}
        missing = [p.name for p in self.parameters if p.name not in given and not p.optional]
        if missing or len(whole) > len(self.names):
            unknown = sorted(set(given) - set(self.names))
            names = ", ".join(self.names)
            raise ValueError(
                f"effect {self.name} takes {names}; missing {missing or 'none'}, unknown {unknown or 'none'}"
            )
        return {name: float(value) for name, value in whole.items()}
