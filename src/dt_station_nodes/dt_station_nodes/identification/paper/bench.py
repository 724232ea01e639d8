"""The objects and controllers the paper's experiments are repeated with."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ...core.closed_loop import ModelPlant, Plant
from ...core.control import LoopConfig, LoopController
from ...core.models import ModelSpec, PlantModel

CONTROLLERS = (
    "pressure_pi",
    "pressure_pi_zn",
    "pressure_pi_tuned",
    "position_pid",
    "position_pid_tuned",
    "position_fuzzy",
    "position_fuzzy_tuned",
)


@dataclass(frozen=True, slots=True)
class Bench:
    """The paper's models, the controllers by name (`CONTROLLERS`), and a fresh rig at rest for every experiment."""

    model: ModelSpec
    controllers: Mapping[str, LoopConfig]
    fresh_rig: Callable[[], Plant]
    sample_time_s: float = 0.02

    def controller(self, name: str) -> LoopController:
        """A controller at the sample time."""
        return LoopController(self.controllers[name], self.sample_time_s)

    def fresh_model(self) -> ModelPlant:
        """The model at rest."""
        return ModelPlant(PlantModel(self.model, self.sample_time_s))

    def samples(self, seconds: float) -> int:
        """Samples in a time."""
        return round(seconds / self.sample_time_s)
