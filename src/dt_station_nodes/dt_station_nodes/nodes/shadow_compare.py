"""Compares the object with its twin, sample by sample."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription
from std_srvs.srv import Trigger

from dt_station_msgs.msg import PlantState, Residual, ShadowSummary, TwinModel

from ..core.channels import Channel
from ..core.comparison import Score
from ..core.shadow import Shadow, ShadowState
from . import convert, ready
from .diagnostics import Diagnostics, Health, Level
from .parameters import Parameter, ParameterSet
from .qos import LATCHED, STREAM
from .sending import send
from .spinning import run_node
from .stamps import to_stamp

NAME = "shadow_compare"
TABLE = (
    *ready.TABLE,
    Parameter("sample_time_s", 0.02, "the bridge's sample time", "s", 1e-4, 60.0, fixed=True),
    Parameter("window_s", 5.0, "window of the running RMS", "s", 1e-4, 3600.0, fixed=True),
    Parameter("summary_every", 50, "samples between two summaries", "samples", 1, 10**6),
)


@dataclass(frozen=True, slots=True)
class ShadowConfig:
    """How the figures are formed and how often the summary is sent."""

    sample_time_s: float
    window_s: float
    summary_every: int


def _build(values: Mapping[str, Any]) -> ShadowConfig:
    return ShadowConfig(values["sample_time_s"], values["window_s"], values["summary_every"])


class ShadowCompare:
    """The node's own half: two inputs paired by number, residual and summary out."""

    ticker = None

    def __init__(self, node: Node) -> None:
        self._node = node
        self._parameters = ParameterSet(node, TABLE, _build)
        config = self._parameters.config
        self._shadow = Shadow(config.sample_time_s, config.window_s)
        self._state: ShadowState = self._shadow.initial_state()
        self._model = TwinModel()
        self._publisher = node.create_publisher(Residual, "shadow/residual", STREAM)
        self._summary = node.create_publisher(ShadowSummary, "shadow/summary", LATCHED)
        twin = node.create_subscription(PlantState, "twin/state", self._on_twin, STREAM, raw=True)
        node.create_subscription(TwinModel, "twin/model", self._on_model, LATCHED)
        node.create_service(Trigger, "~/reset", self._reset)
        self._diagnostics = Diagnostics(node, self._health)
        values = self._parameters.values
        wanted = ready.parse_readers(values["wait_for_readers"])
        publishers = {"shadow/residual": self._publisher}
        writers = ready.chosen(values["wait_for_writers"], {"twin/state": twin})
        self._gate = ready.ReadyGate(node, wanted, publishers, values["wait_timeout_s"], self._start, writers)

    def close(self) -> None:
        """Nothing to bring to rest."""

    def _start(self) -> Subscription:
        return self._node.create_subscription(PlantState, "object/state", self._on_object, STREAM, raw=True)

    def _reset(self, _: Any, response: Any) -> Any:
        self._state = self._shadow.initial_state()
        response.success, response.message = True, "compares anew from the next sample on"
        return response

    def _on_model(self, model: TwinModel) -> None:
        self._model = model

    def _on_object(self, data: bytes) -> None:
        self._compared(*self._shadow.measured(self._state, convert.state_from_bytes(data)))

    def _on_twin(self, data: bytes) -> None:
        self._compared(*self._shadow.simulated(self._state, convert.state_from_bytes(data)))

    def _compared(self, state: ShadowState, scores: Mapping[Channel, Score] | None) -> None:
        self._state = state
        if scores is None:
            return
        position, pressure = (
            (score.residual, score.ise, score.window_rms, score.fit_percent)
            for score in (scores[Channel.POSITION], scores[Channel.PRESSURE])
        )
        residual = convert.ResidualSample(state.sequence, state.stamp_ns, position, pressure)
        send(self._node, self._publisher, convert.residual_to_bytes(residual))
        if state.ended or (state.sequence + 1) % self._parameters.config.summary_every == 0:
            self._summarise(scores)

    def _summarise(self, scores: Mapping[Channel, Score]) -> None:
        position, pressure = scores[Channel.POSITION], scores[Channel.PRESSURE]
        message = ShadowSummary(
            samples=position.samples,
            missed=self._state.missed,
            model=self._model.name,
            model_sha256=self._model.sha256,
            position_ise=position.ise,
            position_rms=position.rms,
            position_fit=position.fit_percent,
            pressure_ise=pressure.ise,
            pressure_rms=pressure.rms,
            pressure_fit=pressure.fit_percent,
        )
        message.header.stamp = to_stamp(self._state.stamp_ns)
        send(self._node, self._summary, message)

    def _health(self) -> Health:
        values = {"sequence": self._state.sequence, "missed": self._state.missed, "model": self._model.name}
        if not self._gate.ready:
            return Health(Level.OK, f"waiting for {', '.join(self._gate.missing())}", values)
        if self._state.missed:
            return Health(Level.WARN, f"{self._state.missed} samples never found their partner", values)
        return Health(Level.OK, "comparing", values)


def make(node: Node) -> ShadowCompare:
    """The node's own half."""
    return ShadowCompare(node)


def main(args: list[str] | None = None) -> int:
    """Run the node."""
    return run_node(NAME, make, args)
