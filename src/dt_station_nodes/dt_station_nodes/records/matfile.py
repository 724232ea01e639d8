"""Variables of a MATLAB file."""

from pathlib import Path

import numpy as np
import scipy.io

from .errors import RecordError
from .tables import Columns


def read_variables(path: Path, wanted: tuple[str, ...]) -> Columns:
    """Numeric vectors of a MAT file (version 4 to 7.2) as arrays of shape (n,); raises RecordError."""
    try:
        if path.stat().st_size == 0:
            raise RecordError(f"{path}: the file is empty")
        content = scipy.io.loadmat(str(path))
    except NotImplementedError:
        raise RecordError(f"{path}: a MAT file of version 7.3; save it with -v7") from None
    except RecordError:
        raise
    except OSError as error:
        if error.errno is None:  # loadmat's own, where the file ends before its data
            raise RecordError(f"{path}: truncated or damaged MAT file ({error})") from None
        raise RecordError(f"{path}: cannot be read ({error.strerror}); check the path") from None
    except Exception as error:  # loadmat raises anything at all on damaged files
        raise RecordError(f"{path}: truncated or damaged MAT file ({' '.join(str(error).split())})") from None
    names = [name for name in content if not name.startswith("__")]
    columns: Columns = {}
    for name in wanted:
        if name not in content:
            raise RecordError(
                f"{path}: no column {name!r}; the file has {', '.join(names) or 'none'} (it may be truncated)"
            )
        columns[name] = _vector(path, name, content[name])
    return columns


def _vector(path: Path, name: str, value: object) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    array = np.asarray(value)
    if array.dtype.kind not in "fiub" or array.size != max(array.shape, default=0):
        raise RecordError(f"{path}: column {name!r} is no vector of real numbers (shape {array.shape})")
    return np.ascontiguousarray(array.reshape(-1), dtype=np.float64)
