"""`python -m dt_station_nodes.nodes NAME [--ros-args ...]` runs one node, as `ros2 run` does."""

import sys
from collections.abc import Sequence

from ..core.errors import StationError
from .lifeline import die_with_parent
from .registry import entry


def main(argv: Sequence[str]) -> int:
    """Run the node named first; the rest is its own. Returns the exit status."""
    if not argv:
        print("name a node", file=sys.stderr)
        return 2
    die_with_parent()
    try:
        return entry(argv[0])(list(argv))
    except StationError as error:
        print(f"{argv[0]}: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
