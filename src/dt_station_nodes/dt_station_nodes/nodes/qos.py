"""The quality of service of every topic, by name."""

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy


def _reliable(depth: int, durability: DurabilityPolicy = DurabilityPolicy.VOLATILE) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=depth, reliability=ReliabilityPolicy.RELIABLE, durability=durability
    )


# Samples, commands, residuals: none may be lost; the depth is a reader's longest pause in samples: over a second at
# the pace of lockstep, which a recorder on a busy machine does pause.
STREAM = _reliable(5000)

# Set-points of a waveform stream as samples do. Readers ask for no history, so that any publisher matches them; a
# set-point that stands is said by a second, latched writer, and latecomers ask for that one (nodes/standing.py).
SETPOINT_WRITER = STREAM
SETPOINT_READER = _reliable(200)

# Waveforms from `ros2 topic pub`, `dt-station set` or any other default publisher.
WAVEFORM = _reliable(10)

# The last value for whoever comes late: the twin's model, the shadow's summary.
LATCHED = _reliable(1, DurabilityPolicy.TRANSIENT_LOCAL)

# Volatile readers match it; ours see the last report of a node that has ended its run.
DIAGNOSTICS_WRITER = _reliable(10, DurabilityPolicy.TRANSIENT_LOCAL)
DIAGNOSTICS_READER = _reliable(100)
