"""`python -m dt_station_nodes.cli` is `dt-station`."""

from .app import main

if __name__ == "__main__":
    raise SystemExit(main())
