"""Measured objects: their models, tables and free runs. The data stays where DT_STATION_DATA says."""

import numpy as np

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PlantModel
from dt_station_nodes.nodes.configuration import find_config
from dt_station_nodes.records import load_run


def model(name):
    return ModelSpec.from_yaml(find_config("models", name).read_text(encoding="utf-8"))


def table(folder, file, data_map):
    return load_run(folder / file, find_config("maps", data_map))


def names(result, channel):
    return {effect.name for effect in result.effects if effect.channel is channel}


def free_run(spec, run, channel, state=None):
    """Simulated from the first sample on, never corrected."""
    plant = PlantModel(spec, run.sample_time_s)
    quiet = np.zeros(len(run))
    load, servo = (run.get(c.voltage_signal) for c in Channel)
    first = {channel.signal: float(run.signals[channel.signal][0])}
    start = plant.initial_state(**first) if state is None else state(plant)
    out = plant.simulate(quiet if load is None else load, quiet if servo is None else servo, state=start)
    return out.pressure_pa if channel is Channel.PRESSURE else out.position_m
