"""`./dt-station`: prepare what is not up to date, then become the command line."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bootstrap.start import main

if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
