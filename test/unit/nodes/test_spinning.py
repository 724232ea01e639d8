"""How a node process ends."""

import subprocess
import sys

import pytest

HELD = """
import threading
from dt_station_nodes.nodes.spinning import end


class Held:
    def remove_node(self, node):
        print("closing", flush=True)
        threading.Event().wait()


class Part:
    ticker = None

    def close(self):
        print("at rest", flush=True)


end(object(), Part(), Held(), {status})
"""


@pytest.mark.parametrize("status", [0, 2])
def test_a_node_that_the_middleware_does_not_let_go_of_ends_with_its_status(status: int) -> None:
    done = subprocess.run(
        [sys.executable, "-c", HELD.format(status=status)], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stdout.split()) == (status, ["at", "rest", "closing"]), done.stderr
