"""Other people's rigs, made up: does discovery answer rightly, or say that it does not know, and in what time?

    python -m benchmarks.discovery.foreign

Each is simulated by equations of its own, finely stepped, and given with a crude linear model only: gain and time
constants off by up to a third, units of its own, one path, sample times from 0.1 ms to 4 s, no validation run.
"""

import time
from typing import Annotated

import typer

from dt_station_nodes.core.models import ModelSpec
from dt_station_nodes.core.run import Run
from dt_station_nodes.discovery import DiscoverySettings, Verdict, discover

from .foreign_axes import axes
from .foreign_oscillators import oscillators
from .foreign_process import processes


def main(
    only: Annotated[str, typer.Option(help="Only rigs with this in their name.")] = "",
    jobs: Annotated[int, typer.Option(help="Workers.")] = 2,
) -> None:
    """One line a rig: what was said, whether that is right, seconds."""
    good = 0
    chosen = [rig for rig in [*oscillators(), *axes(), *processes()] if only in rig.name]
    for rig in chosen:
        signals = {rig.channel.voltage_signal: rig.voltage, rig.channel.signal: rig.measured}
        spec = ModelSpec.model_validate(
            {
                "name": "crude",
                "paths": {rig.channel: {"numerator": rig.numerator, "denominator": rig.denominator, "rest": rig.rest}},
            }
        )
        begin = time.perf_counter()
        result = discover(Run(rig.sample_s, signals), spec, settings=DiscoverySettings(jobs=jobs))
        seconds = time.perf_counter() - begin
        names = frozenset(effect.name for effect in result.effects) - {"parameter_mismatch"}
        silent = result.verdict is Verdict.UNEXPLAINED
        right = rig.unknown if silent else names in rig.right
        possible = [{effect.name, *effect.alternatives} for effect in result.effects]
        among = bool(possible) and any(
            len(want) == len(possible) and all(want & p for p in possible) for want in rig.right
        )
        among = among and not right
        good += right or among
        verdict = "right" if right else ("among its alternatives" if among else ("silent" if silent else "WRONG"))
        spoken = "+".join(f"{e.name} {e.confidence:.2f}" for e in result.effects) or result.verdict.value
        typer.echo(f"{rig.name:44s} {len(rig.measured):7d} {spoken:50s} {verdict:10s} {seconds:6.1f} s")
    typer.echo(f"{good} of {len(chosen)} right")


if __name__ == "__main__":
    typer.run(main)
