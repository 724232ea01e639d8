"""How fast the virtual rig runs on one core: `python -m benchmarks.rig_pace [--json]`.

Prints, for each shipped rig at 20 ms and 1 ms, the time of one sample and how many times faster than life it is.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

from dt_station_nodes.hardware.virtual import RigInput, VirtualRig, load_rig

RIGS = Path(__file__).resolve().parents[1] / "config" / "rigs"
BUSY_S = 0.5


def pace(rig: VirtualRig) -> tuple[float, float]:
    """CPU time of one step (s, best of three) and the ratio of simulated to CPU time."""
    count = max(20, round(BUSY_S * 50 / rig.sample_time_s * 0.02))
    load = 2.5 + 1.5 * np.sin(np.arange(count) * 0.1)
    best = float("inf")
    for _ in range(3):
        state = rig.initial_state()
        start = time.process_time()
        for voltage in load.tolist():
            state, _ = rig.step(state, RigInput(voltage, 0.1))
        best = min(best, (time.process_time() - start) / count)
    return best, rig.sample_time_s / best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    as_json = parser.parse_args().json
    rows = []
    for path in sorted(RIGS.glob("*.yaml")):
        for sample_time_s in (0.02, 0.001):
            step_s, ratio = pace(VirtualRig(load_rig(path), sample_time_s))
            rows.append({"rig": path.stem, "sample_time_s": sample_time_s, "step_us": step_s * 1e6, "realtime": ratio})
    if as_json:
        json.dump({"rows": rows}, sys.stdout, indent=2)
        return
    print(f"{'rig':20} {'sample, ms':>10} {'step, us':>10} {'x real time':>12}")
    for row in rows:
        print(f"{row['rig']:20} {row['sample_time_s'] * 1e3:10g} {row['step_us']:10.1f} {row['realtime']:12.0f}")


if __name__ == "__main__":
    main()
