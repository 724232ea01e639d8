"""Whether two processes on this machine hear each other over the middleware: the heart of `dt-station doctor`.

Run as a program this is the far end: it sends back every message it hears.
"""

import os
import statistics
import subprocess
import sys
import threading
import time
from dataclasses import dataclass

ROUNDS = 200
PATIENCE_S = 15.0
CALL = 0


@dataclass(frozen=True, slots=True)
class Loopback:
    """Round trips between two processes, once they have met: how many came back, and their times in seconds."""

    sent: int
    returned: int
    discovery_s: float
    median_s: float
    p99_s: float
    error: str = ""

    @property
    def healthy(self) -> bool:
        """Whether every message came back."""
        return self.returned == self.sent and not self.error


def measure() -> Loopback:
    """Send messages to a second process and time their return."""
    topic = f"/dt_station/doctor_{os.getpid()}"
    command = [sys.executable, "-m", f"{__package__}.dds_check", topic]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL) as echo:
        try:
            return _measure(topic)
        except Exception as error:
            return Loopback(ROUNDS, 0, 0.0, 0.0, 0.0, f"{type(error).__name__}: {error}")
        finally:
            echo.terminate()


def _measure(topic: str) -> Loopback:
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from std_msgs.msg import UInt64

    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("doctor", context=context, enable_rosout=False, start_parameter_services=False)
    heard: list[int] = []
    try:
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        node.create_subscription(UInt64, f"{topic}/back", lambda message: heard.append(message.data), 10)
        publisher = node.create_publisher(UInt64, f"{topic}/out", 10)
        start = time.monotonic()
        # Each end finds the other in its own time: only an answer shows that both have.
        while not heard:
            if time.monotonic() - start > PATIENCE_S:
                return Loopback(ROUNDS, 0, PATIENCE_S, 0.0, 0.0, "no second process was discovered")
            publisher.publish(UInt64(data=CALL))
            executor.spin_once(timeout_sec=0.05)
        discovery = time.monotonic() - start
        times = []
        for number in range(CALL + 1, CALL + 1 + ROUNDS):
            begin = time.monotonic()
            publisher.publish(UInt64(data=number))
            while number not in heard[-1:] and time.monotonic() - begin < 1.0:
                executor.spin_once(timeout_sec=0.1)
            if number in heard[-1:]:
                times.append(time.monotonic() - begin)
        times.sort()
        if not times:
            return Loopback(ROUNDS, 0, discovery, 0.0, 0.0, "no message came back")
        return Loopback(ROUNDS, len(times), discovery, statistics.median(times), times[int(0.99 * (len(times) - 1))])
    finally:
        node.destroy_node()
        context.try_shutdown()


def _end_with_parent() -> None:
    """The pipe from the doctor closes when it ends, however it ends."""
    sys.stdin.read()
    os._exit(0)


def main() -> None:
    """Send back what is heard until told to stop."""
    import rclpy
    from rclpy.executors import ExternalShutdownException
    from std_msgs.msg import UInt64

    topic = sys.argv[1]
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        rclpy.init()
        node = rclpy.create_node("doctor_echo", enable_rosout=False, start_parameter_services=False)
        publisher = node.create_publisher(UInt64, f"{topic}/back", 10)
        node.create_subscription(UInt64, f"{topic}/out", publisher.publish, 10)
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
