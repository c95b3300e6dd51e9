"""Fails on a forbidden arrow: a folder that uses one it must not know. The allowed arrows are docs/architecture.md's table,
and host/python/README.md's for the rooms of the Python package."""

import ast
import re
from pathlib import Path

from .tree import ROOT

# folder -> what its files may include, import or name, folders within these included. A folder may always use itself
# and protocol/gen. A folder within another stands before it.
ALLOWED = {
    "firmware/dspic": [],
    "fpga/bridge_rtl": [],
    "fpga/usb": ["protocol"],  # for descriptors
    "fpga/formal": ["fpga/bridge_rtl"],
    "fpga/boards": ["fpga/bridge_rtl", "fpga/usb", "protocol"],
    "host/libwhisker": [],
    "host/nav/touch": ["host/nav/problem"],  # random numbers
    "host/nav/problem": [],
    "host/nav/measurement": ["host/nav/problem"],
    "host/nav/field": ["host/nav/problem", "host/nav/measurement"],
    "host/nav/belief": ["host/nav/problem", "host/nav/measurement", "host/nav/field"],
    "host/nav/filter": ["host/nav/problem", "host/nav/measurement", "host/nav/field", "host/nav/belief"],
    "host/nav/mapping": [
        "host/nav/problem",
        "host/nav/measurement",
        "host/nav/belief",
        "host/nav/filter",
    ],  # rows of a replay
    "host/nav/planning": ["host/nav/problem"],
    "host/nav": [],
    "host/create": [],
    "host/command_line": [],
    "host/apps": ["host/libwhisker", "host/nav", "host/create", "host/command_line"],
    "host/python": ["host/libwhisker", "host/nav", "host/create", "protocol"],
    "lab": ["host/python", "sim/signals", "protocol"],
    "sim/common": [],
    "sim/mlx90333": ["sim/common", "sim/node", "firmware/dspic"],  # one copy of the data sheet
    "sim/dspic": ["firmware/dspic"],  # addresses and bits, and what the accessors call
    "sim/node": ["sim/common", "sim/mlx90333", "sim/dspic", "firmware/dspic"],
    "sim/mechanics": ["sim/common", "host/nav/problem"],  # interpolation
    "sim/world": ["sim/common", "sim/mechanics"],
    "sim/signals": ["sim/common", "sim/world", "sim/mechanics", "sim/mlx90333", "sim/node"],
    "sim/create": ["sim/common", "sim/world", "sim/mechanics", "host/command_line"],
    "sim/usb/host": [],
    "sim/usb/device": ["sim/usb/host", "fpga/usb"],
    "sim/usb": ["protocol"],
    "sim/bridge": [
        "sim/common",
        "sim/usb/host",
        "sim/usb/device",
        "sim/node",
        "sim/mlx90333",
        "sim/mechanics",
        "fpga/bridge_rtl",
        "fpga/usb",
    ],
    "sim/robot": [
        "host/command_line",
        "sim/common",
        "sim/bridge",
        "sim/usb",
        "sim/world",
        "sim/create",
        "sim/mechanics",
        "sim/node",
        "sim/mlx90333",
    ],
}
# Of each Python package: room -> rooms it may use besides its own and the modules that lie in no room, which use none.
# A room stands below all it uses: nothing reaches back.
ROOMS = {
    "host/python/crunchbot": {
        "": [],
        "bridge": [],
        "touch": ["bridge"],
        "pilot": ["touch"],
        "planning": ["pilot"],
        "nav": [],
        "recording": ["bridge"],
        "robot": ["bridge", "touch", "pilot", "planning", "nav", "recording"],
        "view": ["bridge", "robot"],
        "commands": ["bridge", "touch", "pilot", "nav", "recording", "robot", "view"],
    },
    "lab/crunchbot_lab": {
        "": [],
        "signals": [],
        "simulation": [],
        "scenes": ["simulation"],
        "report": ["scenes"],
        "demo": ["signals", "simulation", "scenes", "report"],
        "commands": ["signals", "simulation", "scenes", "report"],
    },
}
INCLUDE = re.compile(r'^\s*[#`]include\s+["<]([^">]+)[">]', re.MULTILINE)
IMPORT = re.compile(r"^\s*(?:from|import)\s+([a-zA-Z_][\w.]*)", re.MULTILINE)
SUFFIXES = {".c", ".h", ".cpp", ".v", ".vh", ".py"}
PYTHON_PACKAGES = {"crunchbot": "host/python", "crunchbot_lab": "lab", "whisker_protocol": "protocol"}


def room_of(path: Path, root: Path) -> str | None:
    """The folder of the table a file belongs to; tests and benches stand outside, for they may use everything, and so does
    what takes the place of the C library's headers."""
    relative = path.relative_to(root).as_posix()
    if any(part in relative for part in ("/tests/", "/fuzz/", "/test_", "/libc/")):
        return None
    return next((room for room in ALLOWED if relative.startswith(room + "/")), None)


def owners(files: list[Path], root: Path) -> dict[str, set[str]]:
    """Header name (and path tails of it) -> the rooms that hold such a file."""
    found: dict[str, set[str]] = {}
    for path in files:
        room = room_of(path, root)
        parts = path.relative_to(root).parts
        for n in range(1, len(parts) + 1):
            found.setdefault("/".join(parts[-n:]), set()).add(room or "")
    return found


def uses(path: Path, owner_of: dict[str, set[str]], room: str) -> set[str]:
    """Rooms whose headers or packages a file names; a header that its own room, or one it may use, holds is the one meant."""
    text = path.read_text(errors="replace")
    if path.suffix == ".py":
        roots = {name.split(".")[0] for name in IMPORT.findall(text)}
        return {PYTHON_PACKAGES[name] for name in roots & PYTHON_PACKAGES.keys()}
    owners_named = (owner_of.get(name, set()) for name in INCLUDE.findall(text))
    own = {room, *ALLOWED[room]}
    return {used for owners_of_one in owners_named if not own & owners_of_one for used in owners_of_one if used}


def imported(path: Path, package: Path) -> set[str]:
    """Rooms and modules at the root of the Python package that one of its files imports."""
    inside = (package.name, *path.relative_to(package).parent.parts)
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            start = [*inside[: len(inside) - node.level + 1], node.module] if node.level else [node.module]
            names = [".".join([*filter(None, start), name.name]) for name in node.names]
        else:
            names = [name.name for name in node.names] if isinstance(node, ast.Import) else []
        found |= {name.split(".")[1] for name in names if name.startswith(package.name + ".")}
    return found


def room_violations(root: Path = ROOT) -> list[str]:
    """Arrows between rooms of a Python package that its table does not allow."""
    bad = []
    for place, rooms in ROOMS.items():
        package = root / place
        for path in sorted(package.rglob("*.py")):
            room = (path.relative_to(package).parts[:-1] or ("",))[0]
            used = {name for name in imported(path, package) - {room} if (package / name).is_dir()}
            for name in sorted(used - set(rooms.get(room, []))):
                where = f"{path.relative_to(root)}: {room or 'the root'}"
                bad.append(f"{where} must not use {name}; move the code or turn the arrow round")
    return bad


def violations(root: Path = ROOT) -> list[str]:
    files = [p for room in ALLOWED for p in (root / room).rglob("*") if p.suffix in SUFFIXES]
    owner_of = owners(files, root)
    bad = []
    for path in files:
        room = room_of(path, root)
        if room is None:
            continue
        for used in sorted(uses(path, owner_of, room)):
            if any(used == known or used.startswith(known + "/") for known in (room, *ALLOWED[room])):
                continue
            bad.append(f"{path.relative_to(root)}: {room} must not use {used}; move the code or turn the arrow round")
    return bad


def complaints(root: Path = ROOT) -> list[str]:
    return violations(root) + room_violations(root)
