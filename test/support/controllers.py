"""Shipped models and controllers for tests."""

from pathlib import Path

from dt_station_nodes.core.control import LoopConfig
from dt_station_nodes.core.models import ModelSpec

CONFIG = Path(__file__).resolve().parents[2] / "config"


def controller(name: str) -> LoopConfig:
    """A controller of config/controllers."""
    return LoopConfig.from_yaml((CONFIG / "controllers" / f"{name}.yaml").read_text(encoding="utf-8"), name)


def paper_model() -> ModelSpec:
    """The paper's models."""
    return ModelSpec.from_yaml((CONFIG / "models" / "paper.yaml").read_text(encoding="utf-8"))
