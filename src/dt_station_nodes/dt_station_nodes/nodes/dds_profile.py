"""The profile of Fast DDS, unless the user has one: messages by UDP, lost ones repaired within tens of milliseconds.

Fast DDS asks a reader what it lacks every 3 s. A restarted node, whose readers and writers find their partners one by
one, then waits for its first messages up to three times that long; in lockstep everybody waits with it.
"""

import os

from .configuration import ConfigurationError, config_dir

_FILE = "dds.xml"
# the library's name of before 3.0, and since
_VARIABLES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")


def use_profile() -> None:
    """To be called before the process's first context; children inherit it."""
    if any(os.environ.get(variable) for variable in _VARIABLES):
        return
    try:
        path = config_dir() / _FILE
    except ConfigurationError:
        return
    if path.is_file():
        os.environ.update(dict.fromkeys(_VARIABLES, str(path)))
