"""Let discovery examine one hidden case, then measure what it left of the gap and whether its experiment separates."""

import time
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dt_station_nodes.core.channels import Channel
from dt_station_nodes.core.models import ModelSpec, PlantModel
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import discover
from dt_station_nodes.records import load_run

from .cases import detrended
from .experiments import wave
from .generate import table
from .judge import Judged, Outcome, outcome_of
from .plant import SAMPLE_S, Array, Drive, Nominals, Slot, simulate

SETTLE = 100  # samples left out at the start of a comparison


def unseen_ratio(spec: ModelSpec, run: Run, channel: Channel, noise: float) -> float:
    """Mean square gap of the model driven by the voltages and pressure measured, over the noise's variance."""
    model = PlantModel(spec, run.sample_time_s)
    signals = run.signals
    start = model.initial_state(position_m=float(signals["position_m"][0]))
    load, servo, pressure = signals["load_voltage_v"], signals["servo_voltage_v"], signals["pressure_pa"]
    if channel is Channel.PRESSURE:
        gap = (pressure - model.simulate(load, servo, state=start).pressure_pa)[SETTLE:]
    else:
        made = model.simulate(load, servo, pressure_pa=pressure, state=start, interpolate_pressure=True)
        gap = detrended((signals["position_m"] - made.position_m)[SETTLE:])
    return float(np.mean(np.square(gap)) / noise**2)


def run_of(rows: Array, drive: Drive) -> Run:
    """The station's table of a simulated run, as a run."""
    columns = table(rows, drive).T
    names = (
        "pressure_setpoint_pa",
        "position_setpoint_m",
        "load_voltage_v",
        "servo_voltage_v",
        "pressure_pa",
        "position_m",
    )
    return Run(SAMPLE_S, dict(zip(names, (np.ascontiguousarray(c) for c in columns[1:]), strict=True)))


def follow_up(truth: Mapping[str, Any], waveform: Mapping[str, Any], seed: int) -> Run:
    """The proposed experiment on the hidden object, closed or open loop as proposed, the other channel moving too."""
    n = round(float(waveform["duration_s"]) / SAMPLE_S)
    first = waveform["channel"] == "pressure"
    closed = waveform["drive"] != "voltage"
    unit = 1.0 if not closed else (1e-6 if first else 100.0)
    shape = waveform["shape"]
    base = np.zeros(n) if shape == "constant" else wave(shape, n, float(waveform["frequency_hz"]))
    if shape == "square":
        phase = (np.arange(n) * SAMPLE_S * float(waveform["frequency_hz"])) % 1.0
        base = np.where(phase < float(waveform["duty"]), 1.0, -1.0)
    signal = unit * (float(waveform["offset"]) + float(waveform["amplitude"]) * base)
    other = 3.0 + 1.5 * wave("sine", n, 0.23) if not first else 3.0 * wave("triangle", n, 0.17)
    load, servo = (signal, other) if first else (other, signal)
    start = 0.0 if first else (float(signal[0]) if closed else 0.0)
    drive = Drive(load, servo, closed or not first, closed or first, 0, start_cm=start)
    made = truth["object"]
    slots = tuple(Slot(s["channel"], s["code"], tuple(s["numbers"])) for s in made["slots"])
    rng = np.random.default_rng(seed)
    quiet = np.zeros(n)
    clean = simulate(drive, slots, Nominals(**made["nominals"]), quiet, quiet)
    sizes = [
        0.0 if truth["noise_db"] is None else float(np.std(row)) * 10 ** (-truth["noise_db"] / 20) for row in clean[2:]
    ]
    noise = [size * rng.standard_normal(n) for size in sizes]
    return run_of(simulate(drive, slots, Nominals(**made["nominals"]), noise[0], noise[1]), drive)


def examine(
    number: str, folder: Path, truth: Mapping[str, Any], model: ModelSpec, validate: bool, follow: bool
) -> Judged:
    """Discover one case and judge it; an exception counts as a failure, with its last line."""
    wanted = tuple((e["name"], e["channel"]) for e in truth["effects"])
    library = truth["kind"] != "outside"
    started = time.perf_counter()
    error, separated, ratio = "", None, None
    try:
        run = load_run(folder / "run.csv")
        validation = load_run(folder / "validation.csv") if validate else None
        result = discover(run, model, validation=validation, jobs=1)
        said = result.to_json()
    except Exception as failure:
        error = "".join(traceback.format_exception(failure)[-2:]).strip()
        said = {"verdict": "error", "effects": [], "next_experiment": None}
        outcome = Outcome.WRONG
    else:
        outcome = outcome_of(wanted, said, library)
    seconds = time.perf_counter() - started
    if not error and len(wanted) == 1 and library and truth["noise_db"]:
        channel = Channel(wanted[0][1])
        noise = truth["noise"][2][channel.signal]
        ratio = unseen_ratio(result.model, load_run(folder / "unseen.csv"), channel, noise)
    if follow and not error and said["next_experiment"] and library and wanted:
        second = follow_up(truth, said["next_experiment"]["waveform"], int(number))
        again = discover(second, model, validation=run, jobs=1).to_json()
        separated = outcome_of(wanted, again, library) is Outcome.EXACT
    return Judged(
        number, truth["kind"], wanted, tuple((e["name"], e["channel"]) for e in said["effects"]),
        tuple(sorted({a for e in said["effects"] for a in e["alternatives"]})), said["verdict"], outcome,
        max((float(e["confidence"]) for e in said["effects"]), default=0.0), seconds,
        family=truth["effects"][0]["form"] + "/" + truth["effects"][0]["family"] if wanted else "",
        severity=max((e["severity"] for e in truth["effects"]), default=-1), shape=truth["shape"],
        noise_db=truth["noise_db"],
        visibility=max((truth["visibility"][c] for _, c in wanted), default=0.0), ratio=ratio, separated=separated,
        error=error,
    )  # fmt: skip
