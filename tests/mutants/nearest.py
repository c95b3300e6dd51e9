"""Which tests can notice a change of a file: the nearest first, then every test that can reach it.

A step is a list of commands that all must pass for the mutant to go on to the next step.
"""

import ast
from dataclasses import dataclass
from functools import cache
from pathlib import Path

BUILD = "build/release"
PACKAGES = {"host/python": "crunchbot", "lab": "crunchbot_lab"}  # place: package
PYTHON_TESTS = ("host/python/tests", "tests", "lab/tests")
C_FOLDERS = ("firmware/dspic", "host/libwhisker", "host/nav", "host/create", "host/command_line", "host/apps")
# What the tests of a folder's own programs do not reach: processes driven from Python, nodes on the simulated chip.
ALSO = {
    "firmware/dspic": ("tests/node",),
    "host/apps": ("host/python/tests/pilot/test_base.py", "tests/chain/test_daemon.py", "tests/chain/test_flash.py"),
}
SLOW_PROGRAMS = "stress_ring|model"
PROOFS = (
    "fpga/formal/test_formal.py::test_proof_holds"  # the other tests there look for the text of mutations of their own
)
BENCHES = "fpga/tb"


@dataclass(frozen=True)
class Step:
    """build: targets of the release build; ctest: folders of it; pytest: paths; sanitizers: CTest under ASan as well."""

    build: tuple[str, ...] = ()
    ctest: tuple[str, ...] = ()
    pytest: tuple[str, ...] = ()
    sanitizers: bool = False


def steps_for(root: Path, file: str) -> list[Step]:
    """Nearest tests, then all that can reach `file` (a path below `root`)."""
    if file.endswith(".v"):
        return [
            Step(pytest=_benches(root, file)),
            Step(
                build=("all",),
                ctest=("sim/usb", "sim/bridge", "sim/robot", "tests/usb", "tests/rigs/boards", "fpga"),
                pytest=(PROOFS, BENCHES),
            ),
        ]
    if file.endswith(".py"):
        return [Step(pytest=near) for near in [_importers(root, file)] if near] + [Step(pytest=PYTHON_TESTS)]
    folder = next(folder for folder in C_FOLDERS if file.startswith(folder))
    also = ALSO.get(folder, ())
    folders = (folder, *(place for place in also if not place.endswith(".py")))
    near = Step(tuple(f"{place}/all" for place in folders), folders, tuple(p for p in also if p.endswith(".py")))
    return [near, Step(("all",), (".",), PYTHON_TESTS, sanitizers=True)]


def _benches(root: Path, file: str) -> tuple[str, ...]:
    """The module's own proof, and the benches whose text names it."""
    module = Path(file).stem
    proof = [f"{PROOFS}[{module}]"] if (root / f"fpga/formal/{module}.vh").exists() else []
    benches = sorted((root / BENCHES).rglob("test_*.py"))
    named = [path.relative_to(root).as_posix() for path in benches if module in _bench_text(path.parent)]
    return (*proof, *named) or (PROOFS, BENCHES)


@cache
def _bench_text(folder: Path) -> str:
    kinds = (".py", ".v", ".sby", ".toml", ".txt")
    return "\n".join(path.read_text() for path in sorted(folder.iterdir()) if path.suffix in kinds)


def _importers(root: Path, file: str) -> tuple[str, ...]:
    """Test files that import this module; where there are none, those that import a module that does."""
    module = _module_at(Path(file))
    tests = _imports(root, PYTHON_TESTS)
    direct = tuple(path for path, names in tests.items() if module in names and Path(path).name.startswith("test_"))
    if direct:
        return direct
    users = {_module_at(Path(path)) for path, names in _product(root).items() if module in names}
    return tuple(path for path, names in tests.items() if users & names and Path(path).name.startswith("test_"))


@cache
def _imports(root: Path, folders: tuple[str, ...]) -> dict[str, frozenset[str]]:
    paths = [path for folder in folders for path in sorted((root / folder).rglob("*.py"))]
    return {path.relative_to(root).as_posix(): _names(path, "") for path in paths}


@cache
def _product(root: Path) -> dict[str, frozenset[str]]:
    paths = [path for place, name in PACKAGES.items() for path in sorted((root / place / name).rglob("*.py"))]
    modules = {path.relative_to(root): _module_at(path.relative_to(root)) for path in paths}
    return {path.as_posix(): _names(root / path, name) for path, name in modules.items()}


def _module_at(path: Path) -> str:
    """The dotted name of a module at this path of the tree; empty for a file of no package."""
    place = next((place for place in PACKAGES if path.is_relative_to(place)), None)
    if place is None:
        return ""
    parts = path.relative_to(place).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _names(path: Path, module: str) -> frozenset[str]:
    """Modules that a file imports, absolute; `from package import name` counts as both package and package.name."""
    found: set[str] = set()
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            found |= {base} | {f"{base}.{alias.name}" for alias in node.names}
    return frozenset(found)
