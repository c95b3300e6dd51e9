"""Instructions per second of the robot's netbook side: whiskerd, pilot, whisker-base.

`perf stat` counts user instructions of pilot and base in two lock-step runs of the whole robot, bytes level; the
difference of the two is free of start-up. The kernel's share (sockets, serial line) is not in. whiskerd's are those of
tools/benches host, with 28 lanes.
"""

import json
import subprocess
import tempfile
from pathlib import Path

from crunchbot import scene as scene_files
from crunchbot_lab.demo.chain import ChainRun, Link, run_chain
from crunchbot_lab.simulation.scenes import make_scene

ATOM_HZ = 0.8e9  # instructions per second of the paper's netbook
PROGRAMS = ("pilot", "base")
ROOT = Path(__file__).resolve().parents[3]
HOST, BATCH, FRAMES_PER_S = ROOT / "bench/results/host.json", "2", 2000  # frames of a transfer: most instructions
INTERVAL_MS = "200"
SECONDS = (4.0, 14.0)  # of the two runs
SEED, LANES = 8101, 6


def usable() -> bool:
    """Whether this machine lets perf count."""
    try:
        command = ["perf", "stat", "-x,", "-e", "instructions:u", "true"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return False
    return done.returncode == 0 and "not supported" not in done.stderr


def measure(build: Path, models: Path) -> dict:
    """Program -> instructions per simulated second, and share of the Atom."""
    if not usable():
        return {"skipped": "perf cannot count instructions on this machine"}
    short, long = (_counted(build, models, seconds) for seconds in SECONDS)
    rate = {name: (long[name] - short[name]) / (SECONDS[1] - SECONDS[0]) for name in PROGRAMS}
    rate["whiskerd"] = FRAMES_PER_S * json.loads(HOST.read_text())["instructions_per_frame"][BATCH]["total"]
    rate["all"] = sum(rate.values())
    return {name: {"per_s": value, "atom_share": value / ATOM_HZ} for name, value in rate.items()}


def _counted(build: Path, models: Path, seconds: float) -> dict[str, float]:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        counts = {name: out / f"{name}.count" for name in PROGRAMS}
        before = {
            name: ("perf", "stat", "-I", INTERVAL_MS, "-x,", "-e", "instructions:u", "-o", str(path), "--")
            for name, path in counts.items()
        }
        run = ChainRun(out, build, SEED, seconds, LANES, Link(6, 30, 5), 1, "bytes", before)
        scene, start = make_scene(SEED)
        scene_files.write(run.scene, scene)
        (run.scene / "scene.flat").write_text(scene.flat(start))
        (out / "models").symlink_to(models)
        run_chain(run, lambda tick: None)
        return {name: _count(path.read_text()) for name, path in counts.items()}


def _count(text: str) -> float:
    """The sum of perf's intervals: one who is ended by a signal leaves no sum of its own."""
    rows = [line.split(",") for line in text.splitlines() if "instructions" in line]
    return sum(float(row[1]) for row in rows if row[1].isdigit())
