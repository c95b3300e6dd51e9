"""`make wheels-check`: the wheels of dist/ as a user has them, in an empty environment, and on aarch64 by emulation.

Prints what was downloaded, and how long it took from nothing to a simulated robot that has driven, by the clock and by
the processor: a machine with other work shows the first too long.
"""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

DIST = Path(__file__).resolve().parents[2] / "dist"
CORE_MOST_MB = 40.0
ROBOT_MOST_MB = 150.0
ROBOT_MOST_S = 120.0
DRIVEN_S = 5
EXAMPLE = DIST.parent / "host/python/examples/light_sensor.py"
EMULATOR = "qemu-aarch64-static"
ARM_PACKAGES = "base-files,python3-minimal,libpython3-stdlib,libstdc++6"


def run(*words: object, **options) -> str:
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)
    if done.returncode != 0:
        sys.exit(f"wheels: {' '.join(map(str, words[:5]))} failed: {done.stdout[-2000:]}{done.stderr[-2000:]}")
    return done.stdout


def megabytes(folder: Path) -> float:
    return sum(file.stat().st_size for file in folder.iterdir()) / 1e6


def processor_s() -> float:
    """Seconds of processor that the processes started here and ended have used."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def install(what: str, folder: Path) -> tuple[Path, float]:
    """An environment with `what` of the wheels, and the megabytes that it took from the package index and dist/."""
    environment, downloads = folder / "venv", folder / "downloads"
    run(sys.executable, "-m", "venv", environment)
    pip = [environment / "bin/pip", "--quiet", "--disable-pip-version-check", "--no-cache-dir"]
    run(*pip, "download", "--only-binary", ":all:", "--find-links", DIST, "--dest", downloads, what)
    run(*pip, "install", "--no-index", "--find-links", downloads, what)
    return environment / "bin", megabytes(downloads)


def check_core(folder: Path) -> bool:
    programs, downloaded_mb = install("crunchbot", folder)
    print(f"core: {downloaded_mb:.0f} MB downloaded; {run(programs / 'python', EXAMPLE).strip()}")
    run(programs / "whisker", "--version")
    return downloaded_mb <= CORE_MOST_MB


def check_robot(folder: Path) -> bool:
    began, used_before_s = time.monotonic(), processor_s()
    programs, downloaded_mb = install("crunchbot[lab]", folder)
    installed_s = time.monotonic() - began
    words = ["robot", "--simulated", "--desktop", "--no-view", "--seconds", DRIVEN_S, "--ring", "whisker-check"]
    nothing_learnt = os.environ | {"XDG_CACHE_HOME": str(folder / "cache")}  # as at a user's first robot
    run(programs / "whisker", *words, "--first-port", 7741, "--out", folder / "run", env=nothing_learnt)
    took_s, used_s = time.monotonic() - began, processor_s() - used_before_s
    rows = len((folder / "run/truth.csv").read_text().splitlines())
    print(
        f"robot: {downloaded_mb:.0f} MB downloaded; it had driven {DRIVEN_S} s ({rows} rows) after {took_s:.0f} s, "
        f"{installed_s:.0f} s of them to install; {used_s:.0f} s of processor, load {os.getloadavg()[0]:.1f}"
    )
    return downloaded_mb <= ROBOT_MOST_MB and took_s <= ROBOT_MOST_S


def check_aarch64(folder: Path) -> bool:
    """Debian's Python for arm64, unpacked, not installed; what it runs is emulated."""
    if missing := [name for name in (EMULATOR, "mmdebstrap") if shutil.which(name) is None]:
        print(f"aarch64: not run: {', '.join(missing)} missing; apt-get install qemu-user-static mmdebstrap")
        return False
    root, packages = folder / "root", folder / "packages"
    # A mirror that lags behind serves for this check.
    stale = '--aptopt=Acquire::Check-Valid-Until "false"'
    run("mmdebstrap", "--arch=arm64", "--variant=extract", stale, f"--include={ARM_PACKAGES}", "stable", root)
    python = next(path for path in (root / "usr/bin").glob("python3.*") if path.name.removeprefix("python3.").isdigit())
    version = python.name.removeprefix("python3.")
    platforms = [word for tag in ("2_28", "2_27", "2_17") for word in ("--platform", f"manylinux_{tag}_aarch64")]
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary", ":all:"]
    run(*pip, *platforms, "--python-version", f"3.{version}", "--find-links", DIST, "--target", packages, "crunchbot")
    # The ring is not tried: the emulator lacks calls of the system that it makes.
    said = run(EMULATOR, "-L", root, "-E", f"PYTHONPATH={packages}", python, EXAMPLE)
    print(f"aarch64, CPython 3.{version}: {said.strip()}")
    return True


def main() -> int:
    if not any(DIST.glob("crunchbot-*.whl")):
        sys.exit("wheels: dist/ has none; run: make wheels")
    good = True
    for check in (check_core, check_robot, check_aarch64):
        with tempfile.TemporaryDirectory(prefix="wheels-") as folder:
            good = check(Path(folder)) and good
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
