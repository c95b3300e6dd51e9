"""Compiles signals/_sim: the simulated world at level 1 as a Python module (cffi, API mode).

Declarations are taken from the headers, between the lines `/* cffi: begin */` and `/* cffi: end */`, so nothing is
declared twice. Usage: build_signals_ffi.py --build-dir build/release
"""

import argparse
import re
import shutil
import sys
import tempfile
from pathlib import Path

import cffi

HERE = Path(__file__).resolve().parent
SIM = HERE.parent
BLOCK = re.compile(r"/\* cffi: begin \*/\n(.*?)/\* cffi: end \*/", re.DOTALL)

# Headers that others build on come first: cffi wants a struct before its use.
MECHANICS = ("floor", "whisker", "elastica", "vibration", "shaft", "drag")
HEADERS = [
    SIM / "world" / "sim_scene.h",
    SIM / "world" / "sim_world.h",
    HERE / "signals.h",
    *(SIM / "mechanics" / f"mech_{name}.h" for name in MECHANICS),
    HERE / "mechanics.h",
]
# A header of another folder that a declaration needs: the struct is known to C, opaque to Python.
FOREIGN = "struct sim_field;"
ARCHIVES = ["sim_signals", "sim_world", "sim_mechanics", "sim_mlx90333"]  # in the order of the linker


def declarations() -> str:
    return "\n".join([FOREIGN, *(block for header in HEADERS for block in BLOCK.findall(header.read_text()))])


def find_archives(build: Path) -> list[Path]:
    """The static libraries; FileNotFoundError says which is missing."""
    found = {name: next(iter(sorted(build.rglob(f"lib{name}.a"))), None) for name in ARCHIVES}
    missing = [name for name, path in found.items() if path is None]
    if missing:
        raise FileNotFoundError(f"{build}: no lib{missing[0]}.a; run cmake --build {build} first")
    return [path for path in found.values() if path is not None]


def compile_module(archives: list[Path]) -> Path:
    """Makes the module and puts it beside this file. Returns its path."""
    ffi = cffi.FFI()
    ffi.cdef(declarations())
    ffi.set_source(
        "_sim",
        "\n".join(f'#include "{header}"' for header in HEADERS),
        include_dirs=[str(SIM / folder) for folder in ("world", "mechanics", "node")],
        extra_link_args=[*map(str, archives), "-lm"],
        extra_compile_args=["-O2", "-std=gnu11"],
    )
    with tempfile.TemporaryDirectory() as scratch:
        made = Path(ffi.compile(tmpdir=scratch))
        # A new file under the old name: a process that has the old module mapped keeps its own.
        fresh = HERE / f".{made.name}.new"
        shutil.copy(made, fresh)
        return fresh.replace(HERE / made.name)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build-dir", type=Path, required=True, help="CMake's build folder, with the static libraries")
    try:
        module = compile_module(find_archives(parser.parse_args(argv).build_dir.resolve()))
    except FileNotFoundError as error:
        print(f"build_signals_ffi: {error}", file=sys.stderr)
        return 1
    print(f"build_signals_ffi: {module}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
