"""The wheels' exported cmake files name the include folders of the machine they were built on; ours are elsewhere."""

import os
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

_PYTHON_INCLUDE = re.compile(r"/opt/python/cp3[^/;\"]*/include/python3\.\d+t?")
_NUMPY_INCLUDE = re.compile(r"/opt/python/cp3[^/;\"]*/lib/python3\.\d+t?/site-packages/numpy/_?core/include")


def corrected(text: str, python_include: str, numpy_include: str) -> str:
    """Return a cmake file's text with the include folders of this environment."""
    text = _NUMPY_INCLUDE.sub(lambda _: numpy_include, text)
    return _PYTHON_INCLUDE.sub(lambda _: python_include, text)


def cmake_files(prefix: Path) -> Iterator[Path]:
    """Yield the cmake files that installed packages export below prefix/share."""
    for package in sorted((prefix / "share").glob("*/cmake")):
        yield from sorted(package.glob("*.cmake"))


def correct_prefix(prefix: Path, python_include: str, numpy_include: str) -> int:
    """Correct every exported cmake file below prefix; returns how many changed."""
    changed = 0
    for path in cmake_files(prefix):
        text = path.read_text(encoding="utf-8")
        better = corrected(text, python_include, numpy_include)
        if better != text:
            replace_file(path, better)
            changed += 1
    return changed


def replace_file(path: Path, text: str) -> None:
    """Write a file anew and rename it into place: the installer's cache may share the old one by a hard link."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(text)
    Path(temporary).chmod(0o644)
    Path(temporary).replace(path)
