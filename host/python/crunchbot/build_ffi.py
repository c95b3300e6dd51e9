"""Compiles crunchbot/_native: the C libraries as a Python module (cffi, API mode).

Declarations are taken from the public headers, between the lines `/* cffi: begin */` and `/* cffi: end */`, so nothing
is declared twice. Usage: build_ffi.py --build-dir build/release links the static libraries built there; setup.py takes
`wheel_ffi` instead, which compiles the libraries' sources into the module: a wheel needs a C compiler and no CMake.
"""

import argparse
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

import cffi

HERE = Path(__file__).resolve().parent
HOST = HERE.parents[1]
ROOT = HOST.parent
BLOCK = re.compile(r"/\* cffi: begin \*/\n(.*?)/\* cffi: end \*/", re.DOTALL)

# What each library needs beside itself; the order is the linker's.
LIBRARIES = {"whisker-nav": ["m"], "whisker-create": ["m"], "whisker": ["rt", "pthread"]}
# Headers that others build on come first: cffi wants a struct before its use.
HEADERS = {
    "whisker-nav": [
        HOST / "nav" / name
        for name in (
            "touch/contact/contact.h",
            "touch/radial/radial.h",
            "touch/contact/contact_beam.h",
            "touch/contact/contact_state.h",
            "touch/contact/contact_filter.h",
            "touch/texture/texture_features.h",
            "touch/texture/texture_classifier.h",
            "touch/texture/texture_clean.h",
            "touch/texture/texture_novelty.h",
            "touch/texture/texture_stream.h",
            "problem/pose.h",
            "problem/arena.h",
            "problem/sensor_table.h",
            "problem/settings.h",
            "problem/problem.h",
            "filter/filter.h",
            "belief/belief.h",
            "filter/replay.h",
            "filter/fit.h",
            "mapping/mapper.h",
            "planning/coverage.h",
        )
    ],
    "whisker-create": [HOST / "create" / "include" / "create" / name for name in ("judge.h", "motion.h")],
    "whisker": [
        HOST / "libwhisker" / "include" / "whisker" / name
        for name in ("errors.h", "frame.h", "clock.h", "stats.h", "ring.h")
    ],
}
# As host/CMakeLists.txt builds the libraries.
HARDENED_COMPILE = ["-fstack-protector-strong", "-U_FORTIFY_SOURCE", "-D_FORTIFY_SOURCE=3"]
HARDENED_LINK = ["-Wl,-z,relro,-z,now,-z,noexecstack"]
ALL_HEADERS = [header for name in LIBRARIES for header in HEADERS[name]]


def declarations(header: Path) -> str:
    """What the header declares between its cffi markers."""
    return "\n".join(BLOCK.findall(header.read_text()))


def new_ffi() -> cffi.FFI:
    ffi = cffi.FFI()
    for header in ALL_HEADERS:
        ffi.cdef(declarations(header))
    return ffi


def sources(folder: Path, target: str) -> list[Path]:
    """The .c files of a target in this folder's CMakeLists.txt: the one list of them."""
    listed = re.search(rf"add_library\({target} \w+([^)]*)\)", (folder / "CMakeLists.txt").read_text())
    return [folder / name for name in listed.group(1).split()]


def nav_rooms() -> list[Path]:
    """host/nav's folders, whose headers find each other by name: the list in its CMakeLists.txt."""
    listed = re.search(r"set\(WHISKER_NAV_ROOMS ([^)]*)\)", (HOST / "nav" / "CMakeLists.txt").read_text())
    return [HOST / "nav" / name for name in listed.group(1).split()]


def wheel_ffi() -> cffi.FFI:
    """crunchbot._native from sources, without the part that needs libusb and hidapi: that is whiskerd's."""
    ffi = new_ffi()
    files = [*sources(HOST / "nav", "nav"), *sources(HOST / "create", "create")]
    files += sources(HOST / "libwhisker", "whisker_core")
    library = HOST / "libwhisker"
    ffi.set_source(
        "crunchbot._native",
        "\n".join(f'#include "{header}"' for header in ALL_HEADERS),
        sources=[os.path.relpath(file, ROOT) for file in files],
        include_dirs=[
            str(path)
            for path in (
                *(library / p for p in ("include", "src", "src/ring")),
                *(HOST / "create" / p for p in ("include", "src")),
                ROOT / "protocol",
                ROOT / "protocol/gen",
                *nav_rooms(),
            )
        ],
        define_macros=[("_GNU_SOURCE", None)],
        libraries=[library for needed in LIBRARIES.values() for library in needed],
        extra_compile_args=["-O3", "-std=gnu11", "-ffp-contract=off", "-fvisibility=hidden", *HARDENED_COMPILE],
        extra_link_args=HARDENED_LINK,
    )
    return ffi


def find_library(build: Path, name: str) -> Path | None:
    return next(iter(sorted(build.rglob(f"lib{name}.a"))), None)


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build-dir", type=Path, required=True, help="CMake's build folder, with the static libraries")
    parser.add_argument("--libraries", action="store_true", help="only name the static libraries that are linked")
    options = parser.parse_args(argv)
    build = options.build_dir.resolve()
    archives = {name: find_library(build, name) for name in LIBRARIES}
    missing = [f"lib{name}.a" for name, archive in archives.items() if archive is None]
    if missing:
        print(f"build_ffi: {build}: no {' and no '.join(missing)}; run cmake --build {build} first", file=sys.stderr)
        return 1
    if options.libraries:
        print(*archives.values(), sep="\n")
        return 0
    ffi = new_ffi()
    ffi.set_source(
        "_native",
        "\n".join(f'#include "{header}"' for header in ALL_HEADERS),
        include_dirs=[
            str(path) for path in (HOST / "libwhisker" / "include", HOST / "create" / "include", *nav_rooms())
        ],
        extra_link_args=[*(str(archive) for archive in archives.values()), *HARDENED_LINK],
        libraries=[library for needed in LIBRARIES.values() for library in needed],
        extra_compile_args=["-O2", "-std=gnu11", *HARDENED_COMPILE],
    )
    with tempfile.TemporaryDirectory() as scratch:
        made = Path(ffi.compile(tmpdir=scratch))
        # A new file under the old name: a process that has the old module mapped keeps its own.
        fresh = HERE / f".{made.name}.new"
        shutil.copy(made, fresh)
        fresh.replace(HERE / made.name)
    print(f"build_ffi: {HERE / made.name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
