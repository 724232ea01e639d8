"""Objects behind one small door: the virtual rig, measured data, a fake for tests."""

from .backend import Applied, Backend, Reading
from .factory import BackendError, open_backend
from .fake import FakeBackend
from .replay import ReplayBackend

__all__ = ["Applied", "Backend", "BackendError", "FakeBackend", "Reading", "ReplayBackend", "open_backend"]
