"""Filters and other projects' on real floors: a Thymio's public logs, which are other people's and not kept here.

.venv/bin/python tools/benches floors --data DIR       with DIR/thymio/random_1 and random_2
"""

import tempfile
from pathlib import Path

import numpy as np
from tqdm import tqdm

from crunchbot.nav import localise
from crunchbot.nav.observations import Observations
from crunchbot.nav.scoring import lock_row, position_errors
from crunchbot_lab import scenes
from crunchbot_lab.scenes.recordings import read_recording

from .. import store
from .peer_runs import guests, mrpt_entries, python_entries
from .worlds import REAL, RECORDINGS, recordings_option

SETTINGS = ("500", "2000", "300-20000 KLD")  # of the peers
NEAR_M = 0.06


def judged(poses: np.ndarray, us: np.ndarray, rows: Observations) -> dict:
    off = position_errors(poses, rows.truth)
    near = {"near_share": float((off <= NEAR_M).mean()), "error_median_m": float(np.median(off))}
    return near | {"rows_to_lock": lock_row(off), "step_us_mean": float(us.mean())}


def measure(folder: Path, build: Path) -> dict[str, dict]:
    scene, rows = read_recording(folder, kind="thymio")
    found = {}
    for name in localise.filter_names():
        done = localise.run(name, scene, rows, {})
        found[name] = judged(done.poses, done.step_us, rows)
    for peer in (p for p in mrpt_entries(build, 1) + python_entries(build, 1) + guests(1) if p.setting in SETTINGS):
        with tempfile.TemporaryDirectory() as out:
            poses, us = peer.run(Path(out), scenes.Made(scene, rows), 0)
        found[f"{peer.filter} {peer.setting}"] = judged(poses, us, rows)
    return found


def run(build: Path, data: Path | None = None) -> None:
    if data is None:
        return store.leave_out("floors", f"give --data DIR or {RECORDINGS}, the folder of the logs")
    store.write_result("floors", {log: measure(data / "thymio" / log, build) for log in tqdm(REAL, desc="floors")})


options = recordings_option
