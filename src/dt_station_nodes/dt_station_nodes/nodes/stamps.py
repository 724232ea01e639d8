"""Nanoseconds to and from builtin_interfaces/Time."""

from builtin_interfaces.msg import Time

_NANO = 1_000_000_000


def to_stamp(stamp_ns: int) -> Time:
    """The message of a time."""
    seconds, nanoseconds = divmod(stamp_ns, _NANO)
    return Time(sec=seconds, nanosec=nanoseconds)
