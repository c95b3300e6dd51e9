"""Compiles crunchbot_lab/signals/_sim: the simulated world at level 1 as a Python module (cffi, API mode).

Declarations are taken from the headers, between the lines `/* cffi: begin */` and `/* cffi: end */`, so nothing is
declared twice. Usage: build_ffi.py --build-dir build/release links the static libraries built there; setup.py takes
`wheel_ffi` instead, which compiles the libraries' sources into the module: a wheel needs a C compiler and no CMake.
"""

import argparse
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

import cffi

HERE = Path(__file__).resolve().parent
LAB = HERE.parents[1]
ROOT = LAB.parent
SIM = ROOT / "sim"
BLOCK = re.compile(r"/\* cffi: begin \*/\n(.*?)/\* cffi: end \*/", re.DOTALL)

# Headers that others build on come first: cffi wants a struct before its use.
MECHANICS = ("floor", "whisker", "elastica", "vibration", "shaft", "drag")
HEADERS = [
    SIM / "world" / "sim_scene.h",
    SIM / "world" / "sim_contact.h",
    SIM / "world" / "sim_world.h",
    SIM / "signals" / "signals.h",
    *(SIM / "mechanics" / f"mech_{name}.h" for name in MECHANICS),
    SIM / "signals" / "mechanics.h",
]
# A header of another folder that a declaration needs: the struct is known to C, opaque to Python.
FOREIGN = "struct sim_field;"
LIBRARIES = {
    name: SIM / name for name in ("signals", "world", "mechanics", "mlx90333", "common")
}  # in the order of the linker
INCLUDED = [
    *LIBRARIES.values(),
    ROOT / "host/nav/problem",
    ROOT / "firmware/dspic/core",
    ROOT / "protocol/gen",
]


def new_ffi(module: str, **options: Any) -> cffi.FFI:
    """The module's declarations, and how it is compiled."""
    ffi = cffi.FFI()
    ffi.cdef("\n".join([FOREIGN, *(block for header in HEADERS for block in BLOCK.findall(header.read_text()))]))
    included = {"include_dirs": [str(folder) for folder in INCLUDED], "libraries": ["m"]}
    ffi.set_source(module, "\n".join(f'#include "{header}"' for header in HEADERS), **included, **options)
    return ffi


def sources(folder: Path, target: str) -> list[Path]:
    """The .c files of a target in this folder's CMakeLists.txt: the one list of them."""
    listed = re.search(rf"add_library\({target} STATIC([^)]*)\)", (folder / "CMakeLists.txt").read_text())
    return [folder / name for name in listed.group(1).split()]


def wheel_ffi() -> cffi.FFI:
    """crunchbot_lab.signals._sim from sources."""
    files = [file for name, folder in LIBRARIES.items() for file in sources(folder, f"sim_{name}")]
    return new_ffi(
        "crunchbot_lab.signals._sim",
        sources=[os.path.relpath(file, LAB) for file in files],
        define_macros=[("_GNU_SOURCE", None)],
        extra_compile_args=["-O3", "-std=gnu11", "-ffp-contract=off", "-fvisibility=hidden"],
    )


def find_archives(build: Path) -> list[Path]:
    """The static libraries; FileNotFoundError says which is missing."""
    found = {f"libsim_{name}.a": next(iter(sorted(build.rglob(f"libsim_{name}.a"))), None) for name in LIBRARIES}
    missing = [name for name, path in found.items() if path is None]
    if missing:
        raise FileNotFoundError(f"{build}: no {missing[0]}; run cmake --build {build} first")
    return [path for path in found.values() if path is not None]


def compile_module(archives: list[Path]) -> Path:
    """Makes the module and puts it beside this file. Returns its path."""
    link = [str(path) for path in archives]
    ffi = new_ffi("_sim", extra_link_args=link, extra_compile_args=["-O2", "-std=gnu11"])
    with tempfile.TemporaryDirectory() as scratch:
        made = Path(ffi.compile(tmpdir=scratch))
        # A new file under the old name: a process that has the old module mapped keeps its own.
        fresh = HERE / f".{made.name}.new"
        shutil.copy(made, fresh)
        return fresh.replace(HERE / made.name)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build-dir", type=Path, required=True, help="CMake's build folder, with the static libraries")
    parser.add_argument("--libraries", action="store_true", help="only name the static libraries that are linked")
    options = parser.parse_args(argv)
    try:
        archives = find_archives(options.build_dir.resolve())
    except FileNotFoundError as error:
        print(f"build_ffi: {error}", file=sys.stderr)
        return 1
    if options.libraries:
        print(*archives, sep="\n")
    else:
        print(f"build_ffi: {compile_module(archives)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
