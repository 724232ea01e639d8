"""The rules of the house, read off the sources: which way imports point, what is pure, how long a module may be."""

import ast
import re
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "src" / "dt_station_nodes" / "dt_station_nodes"
MIDDLE = {"records", "hardware", "discovery", "identification"}
MAY_IMPORT = {
    "core": set(),
    "workers": {"core"},
    **{name: {"core"} for name in MIDDLE},
    "discovery": {"core", "workers"},
    "nodes": {"core", *MIDDLE},
    "panel": {"core", *MIDDLE},
    "cli": {"core", "nodes", "panel", "workers", *MIDDLE},
}
PURE = {"core", "workers", "identification", "discovery"}
FILES_CLOCK_AND_ROS = set(
    "datetime glob logging os pathlib random rclpy secrets shutil signal socket subprocess sys tempfile time uuid "
    "urllib".split()
)
THREADS = {"asyncio", "concurrent", "multiprocessing", "queue", "threading"}
# Programs that are run as `python -m`, and may thus tell the time and print.
PROGRAMS_IN_PURE_PACKAGES = {"core/models/warm.py"}
# What starts processes tells them which signals are not theirs.
STARTS_PROCESSES = {("workers/pool.py", "signal")}
NEWER_THAN_3_10 = {
    "tomllib": {"*"},
    "typing": {"Self", "StrEnum", "Never", "LiteralString", "Required", "NotRequired", "assert_never", "override"},
    "enum": {"StrEnum", "verify", "ReprEnum"},
    "datetime": {"UTC"},
    "itertools": {"batched"},
}
EXECUTABLES = (
    "daq_bridge load_generator pressure_controller position_controller twin_simulator shadow_compare recorder replayer"
).split()
NODE_LINES = 180
MODULE_LINES = 250


class Import(NamedTuple):
    """One imported thing: the line, the module it is imported from, and its name there."""

    line: int
    module: str
    name: str


@cache
def sources() -> tuple[Path, ...]:
    return tuple(sorted(PACKAGE.rglob("*.py")))


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path), feature_version=(3, 10))


@cache
def tracked() -> tuple[Path, ...]:
    """The checkout's own files: git's, or all but what is ignored where there is no git."""
    try:
        command = ["git", "-C", str(ROOT), "ls-files", "-z"]
        names = subprocess.run(command, capture_output=True, check=True).stdout.decode().split("\0")
    except (OSError, subprocess.CalledProcessError):
        skipped = {".git", ".dt-station", "runs", "build", "install", "log", "__pycache__"}
        names = [str(p.relative_to(ROOT)) for p in ROOT.rglob("*") if not skipped.intersection(p.parts)]
    return tuple(ROOT / name for name in names if name and (ROOT / name).is_file())


def imports(path: Path) -> Iterator[Import]:
    """Every import of a module, relative ones resolved to dotted names from dt_station_nodes on."""
    inside = ["dt_station_nodes", *path.relative_to(PACKAGE).parent.parts]
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(node.lineno, alias.name, "*")
        elif isinstance(node, ast.ImportFrom):
            base = inside[: len(inside) - node.level + 1] if node.level else []
            module = ".".join([*base, *(node.module.split(".") if node.module else [])])
            for alias in node.names:
                yield Import(node.lineno, module, alias.name)


def part(path: Path) -> str:
    """The package of ours that a module belongs to; empty for the root's own __init__."""
    relative = path.relative_to(PACKAGE)
    return relative.parts[0] if len(relative.parts) > 1 else ""


def starts_processes(path: Path, module: str) -> bool:
    return (path.relative_to(PACKAGE).as_posix(), module) in STARTS_PROCESSES


def where(path: Path, line: int) -> str:
    return f"{path.relative_to(ROOT)}:{line}"


def ours(item: Import) -> tuple[str, ...]:
    """The path inside dt_station_nodes that an import reaches, a module named after `from package import` included."""
    parts = item.module.split(".")
    if parts[0] != "dt_station_nodes":
        return ()
    target = (*parts[1:], item.name)
    folder = PACKAGE.joinpath(*target)
    return target if folder.is_dir() or folder.with_suffix(".py").is_file() else tuple(parts[1:])


def test_every_package_has_its_place_in_the_order():
    packages = {path.name for path in PACKAGE.iterdir() if (path / "__init__.py").is_file()}
    assert packages <= MAY_IMPORT.keys()


def test_imports_point_one_way():
    wrong = [
        f"{where(path, item.line)} imports {'.'.join(target)}"
        for path in sources()
        for item in imports(path)
        if (target := ours(item)) and part(path) and target[0] not in {part(path), *MAY_IMPORT[part(path)]}
    ]
    assert not wrong, "\n".join(wrong)


def test_other_packages_are_used_through_their_public_names():
    """From outside, only a package's root, a subpackage's root and direct modules are named, and nothing private."""
    wrong = []
    for path in sources():
        for item in imports(path):
            target = ours(item)
            if not target or target[0] == part(path) or "/".join(target) + ".py" in PROGRAMS_IN_PURE_PACKAGES:
                continue
            too_deep = len(target) > 2 and not PACKAGE.joinpath(*target).is_dir()
            if too_deep or any(name.startswith("_") for name in (*target, item.name)):
                wrong.append(f"{where(path, item.line)} reaches into {'.'.join(target)} for {item.name}")
    assert not wrong, "\n".join(wrong)


def test_pure_packages_have_no_clock_files_or_ros_and_core_no_threads():
    wrong = [
        f"{where(path, item.line)} imports {item.module}"
        for path in sources()
        if part(path) in PURE and str(path.relative_to(PACKAGE)) not in PROGRAMS_IN_PURE_PACKAGES
        for item in imports(path)
        if ((top := item.module.split(".")[0]) in FILES_CLOCK_AND_ROS and not starts_processes(path, top))
        or top.endswith("_msgs")
        or (top in THREADS and part(path) == "core")
    ]
    assert not wrong, "\n".join(wrong)


def test_pure_packages_open_no_file_and_print_nothing():
    wrong = [
        where(path, node.lineno) + f" calls {node.func.id}"
        for path in sources()
        if part(path) in PURE and str(path.relative_to(PACKAGE)) not in PROGRAMS_IN_PURE_PACKAGES
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in {"open", "print", "input"}
    ]
    assert not wrong, "\n".join(wrong)


def test_randomness_is_seeded():
    """Only generators made from a seed: not numpy's global one, and no default_rng() from the system's entropy."""
    allowed = {"default_rng", "Generator", "SeedSequence", "PCG64", "Philox", "BitGenerator"}
    wrong = []
    for path in sources():
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) in {"np.random", "numpy.random"}:
                if node.attr not in allowed:
                    wrong.append(where(path, node.lineno) + f" uses np.random.{node.attr}")
            elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("default_rng") and not node.args:
                wrong.append(where(path, node.lineno) + " seeds from the system")
    assert not wrong, "\n".join(wrong)


def test_numbers_do_not_depend_on_the_machine():
    """No fastmath and no threads inside kernels: both reorder sums."""
    wrong = [
        where(path, node.value.lineno) + f" sets {node.arg}"
        for path in sources()
        for node in ast.walk(tree(path))
        if isinstance(node, ast.keyword)
        and node.arg in {"fastmath", "parallel"}
        and isinstance(node.value, ast.Constant)
        and node.value.value
    ]
    assert not wrong, "\n".join(wrong)


def test_sources_run_on_python_3_10():
    checked = [*sources(), *(path for path in tracked() if path.suffix == ".py" and path not in sources())]
    wrong = []
    for path in checked:
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module in NEWER_THAN_3_10:
                newer = NEWER_THAN_3_10[node.module]
                wrong += [
                    where(path, node.lineno) + f" {a.name}" for a in node.names if a.name in newer or "*" in newer
                ]
            elif isinstance(node, ast.Import):
                wrong += [where(path, node.lineno) for alias in node.names if alias.name == "tomllib"]
    assert not wrong, "\n".join(wrong)


def test_modules_hold_one_concept():
    long = []
    for path in sources():
        lines = len(path.read_text(encoding="utf-8").splitlines())
        most = NODE_LINES if part(path) == "nodes" and path.stem in EXECUTABLES else MODULE_LINES
        if lines > most:
            long.append(f"{path.relative_to(ROOT)}: {lines} lines, at most {most}")
    assert not long, "\n".join(long)


def test_packages_say_what_is_public():
    """An __init__ that re-exports lists its names in __all__, and every name there exists."""
    wrong = []
    for path in sources():
        if path.name != "__init__.py":
            continue
        body = tree(path).body
        exported = [item for item in imports(path) if ours(item)]
        lists = [node for node in body if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"]
        if exported and not lists:
            wrong.append(f"{path.relative_to(ROOT)} re-exports without __all__")
    assert not wrong, "\n".join(wrong)


def test_every_node_is_an_executable_with_a_main():
    setup = (PACKAGE.parent / "setup.py").read_text(encoding="utf-8")
    missing = []
    for name in EXECUTABLES:
        path = PACKAGE / "nodes" / f"{name}.py"
        functions = (
            {node.name for node in tree(path).body if isinstance(node, ast.FunctionDef)} if path.is_file() else {}
        )
        if "main" not in functions or f'"{name}"' not in setup:
            missing.append(name)
    assert not missing


# Written so that this file does not contain what it looks for.
FOREIGN = re.compile(
    r"/wor[k]/|/roo[t]/|/hom[e]/[a-z]|/tm[p]/(?:venv|team)|py[p]i\.org|pythonhoste[d]\.org|/op[t]/pypi"
)


def test_no_file_names_a_machine_or_a_registry_host():
    wrong = []
    for path in tracked():
        data = path.read_bytes()
        if b"\0" in data:
            continue
        text = data.decode("utf-8", errors="replace")
        wrong += [f"{path.relative_to(ROOT)}: {match[0]}" for match in FOREIGN.finditer(text)]
    assert not wrong, "\n".join(wrong)


def test_lock_is_pinned_hashed_and_names_no_host():
    for lock in (ROOT / "requirements.lock", ROOT / "bootstrap" / "uv.lock"):
        text = lock.read_text(encoding="utf-8")
        assert "://" not in text
        assert not re.search(r"^\s*(--?(extra-)?index|-i |--find-links|-f |--trusted)", text, re.MULTILINE)
        heads = [line for line in text.splitlines() if line and not line[0].isspace() and not line.startswith("#")]
        assert heads
        assert all(re.match(r"[a-z0-9][a-z0-9._-]*==\S+( ;.*)? \\$", line) for line in heads)
        assert text.count("--hash=sha256:") >= len(heads)


def test_every_manifest_says_the_same_version():
    found = {
        version
        for package in ("dt_station_msgs", "dt_station_nodes")
        for name, pattern in (("package.xml", r"<version>(.+?)</version>"), ("setup.py", r"version=\"(.+?)\""))
        if (path := ROOT / "src" / package / name).is_file()
        for version in re.findall(pattern, path.read_text(encoding="utf-8"))
    }
    assert len(found) == 1
