"""Parameters from a table: declared with description, range and unit, judged as a whole, applied live."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from ..core.errors import StationError

Config = TypeVar("Config")
Value = bool | int | float | str | list[str] | list[float]


class ParameterError(StationError):
    """A parameter value out of its range or choices."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One line of a node's table. `low` and `high` are inclusive, in `unit`."""

    name: str
    default: Value
    text: str
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    choices: tuple[str, ...] = ()
    fixed: bool = False

    @property
    def bounded(self) -> bool:
        """Whether there is a range."""
        return self.low > -math.inf or self.high < math.inf

    def descriptor(self) -> ParameterDescriptor:
        """What `ros2 param describe` shows."""
        description = f"{self.text} [{self.unit}]" if self.unit else self.text
        described = ParameterDescriptor(description=description, read_only=self.fixed)
        if self.choices:
            described.additional_constraints = f"one of {', '.join(self.choices)}"
        if isinstance(self.default, float):
            # lets `2` stand for `2.0`; the range is then ours to check, and shown all the same
            described.dynamic_typing = True
            if self.bounded:
                described.floating_point_range = [FloatingPointRange(from_value=self.low, to_value=self.high)]
        elif isinstance(self.default, int) and not isinstance(self.default, bool) and self.bounded:
            low = -(2**63) if self.low == -math.inf else int(self.low)
            high = 2**63 - 1 if self.high == math.inf else int(self.high)
            described.integer_range = [IntegerRange(from_value=low, to_value=high)]
        return described

    def checked(self, value: Any) -> Any:
        """The value in its own type. Raises ParameterError."""
        if isinstance(self.default, float):
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise ParameterError(f"{self.name} must be a number, got {value!r}")
            value = float(value)
            if self.bounded and not self.low <= value <= self.high:
                raise ParameterError(
                    f"{self.name} must lie in {self.low:g} to {self.high:g} {self.unit}".rstrip() + f", got {value:g}"
                )
        elif isinstance(self.default, list):
            return list(value or ())
        elif type(value) is not type(self.default):
            raise ParameterError(f"{self.name} must be {type(self.default).__name__}, got {value!r}")
        elif isinstance(value, int) and not isinstance(value, bool) and not self.low <= value <= self.high:
            raise ParameterError(f"{self.name} must lie in {self.low:g} to {self.high:g}, got {value}")
        if self.choices and value not in self.choices:
            raise ParameterError(f"{self.name} must be one of {', '.join(self.choices)}, got {value!r}")
        return value


class ParameterSet(Generic[Config]):
    """A node's parameters and the frozen configuration they make.

    `build` turns all values into a configuration or raises a ValueError whose sentence is the reason given
    to whoever set them; `apply` is called with every new configuration after it was accepted.
    """

    def __init__(
        self,
        node: Node,
        table: Sequence[Parameter],
        build: Callable[[Mapping[str, Any]], Config],
        apply: Callable[[Config], None] | None = None,
    ) -> None:
        self._node = node
        self._table = {parameter.name: parameter for parameter in table}
        self._build = build
        self._apply = apply
        for parameter in table:
            node.declare_parameter(
                parameter.name,
                parameter.default if parameter.default != [] else RosParameter.Type.STRING_ARRAY,
                parameter.descriptor(),
            )
        self.values = {name: parameter.checked(_read(node, parameter)) for name, parameter in self._table.items()}
        self.config = build(self.values)
        node.add_on_set_parameters_callback(self._judge)
        node.add_post_set_parameters_callback(self._adopt)

    def set(self, changes: Mapping[str, Value]) -> None:
        """Set several at once from inside the node. Raises ValueError with the reason of a refusal."""
        # judged here first: rclpy raises its own kind of error for a value out of its range
        self._build({**self.values, **{name: self._table[name].checked(value) for name, value in changes.items()}})
        result = self._node.set_parameters_atomically(
            [RosParameter(name, value=value) for name, value in changes.items()]
        )
        if not result.successful:
            raise ParameterError(result.reason)

    def _merged(self, parameters: Sequence[Any]) -> dict[str, Any]:
        changes = {p.name: self._table[p.name].checked(p.value) for p in parameters if p.name in self._table}
        return {**self.values, **changes}

    def _judge(self, parameters: Sequence[Any]) -> SetParametersResult:
        try:
            self._build(self._merged(parameters))
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _adopt(self, parameters: Sequence[Any]) -> None:
        merged = self._merged(parameters)
        if merged == self.values:
            return
        self.values = merged
        self.config = self._build(merged)
        if self._apply is not None:
            self._apply(self.config)


def _read(node: Node, parameter: Parameter) -> Any:
    if parameter.default == []:
        return node.get_parameter_or(parameter.name, RosParameter(parameter.name, value=[])).value
    return node.get_parameter(parameter.name).value
