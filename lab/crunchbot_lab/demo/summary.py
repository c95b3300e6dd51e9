"""summary.json (docs/formats.md) from the files that a run leaves.

moving                  the tip's path in the 100 ms window is at least 5 mm
texture_accuracy        of the windows that the pilot read, moving, tip at least 50 mm inside its tile at the window's end:
                        share whose largest log-likelihood names the tile's texture
texture_accuracy_all    the same without the condition on the tile's border
texture_windows_share   windows that texture_accuracy counts, of all moving windows with the tip so far inside a tile
frames_sent             ticks of the world while the bridge was started
frames_received         distinct sequence numbers that whisker-log saw
records_bad_*           pairs (lane, tick): injected by the simulation, and flagged bad in what whisker-log read
*_error_*               over every row from the first
rows_*                  observation rows: sent by the pilot; weighed, and missed, by the navigator behind the network
base_frames, base_bad   sensor frames of the base, whole; begun but not whole, or never come
"""

import csv
from pathlib import Path

import numpy as np

from crunchbot.nav import localise
from crunchbot.scene import Scene

MOVING_MM = 5.0
INSIDE_MM = 50.0


def texture_scores(rows: list[dict], truth: list[dict], scene: Scene) -> dict[str, float]:
    """Accuracies over windows of all floor whiskers; rows and truth as mappings of numbers (None: not read)."""
    textures = scene.arena.textures
    counted = {"all": [0, 0], "inside": [0, 0]}
    moving_inside = 0
    for row, true in zip(rows, truth, strict=True):
        for whisker in scene.robot.of_role("texture"):
            if float(true[f"{whisker.name}_moved_mm"]) < MOVING_MM:
                continue
            inside = float(true[f"{whisker.name}_inside_mm"]) >= INSIDE_MM
            moving_inside += inside
            logliks = [row[f"{whisker.name}_{texture}"] for texture in textures]
            if any(value is None for value in logliks):
                continue
            right = textures[int(np.argmax(logliks))] == true[f"{whisker.name}_tile"]
            for kind in ("all", "inside") if inside else ("all",):
                counted[kind][0] += right
                counted[kind][1] += 1
    return {
        "texture_accuracy": _share(*counted["inside"]),
        "texture_accuracy_all": _share(*counted["all"]),
        "texture_windows_share": _share(counted["inside"][1], moving_inside),
    }


def pose_scores(poses: dict[str, np.ndarray], truth: np.ndarray) -> dict[str, float]:
    """Errors of the poses (n, 3) of `grid`, `adaptive`, `foveal` and `odometry` against truth (n, 3)."""
    names = ("grid", "adaptive", "foveal", "odometry")
    grid, adaptive, foveal, odometry = (localise.pose_errors(poses[name], truth) for name in names)
    return {
        "pose_error_median_m": grid["pose_error_median_m"],
        "pose_error_p90_m": grid["pose_error_p90_m"],
        "heading_error_median_rad": grid["heading_error_median_rad"],
        "odometry_error_median_m": odometry["pose_error_median_m"],
        "foveal_error_median_m": foveal["pose_error_median_m"],
        "adaptive_error_median_m": adaptive["pose_error_median_m"],
        "adaptive_error_p90_m": adaptive["pose_error_p90_m"],
    }


def fault_scores(faults: Path, bad: Path) -> dict:
    """Injected against reported (lane, tick) pairs."""
    injected, reported = read_pairs(faults), read_pairs(bad)
    return {
        "records_bad_injected": len(injected),
        "records_bad_reported": len(reported),
        "records_bad_match": injected == reported,
    }


def link_scores(pilot: dict, navigator: dict) -> dict:
    """What pilot.json and navigator.json hold about network and serial line."""
    base = pilot["base"]
    return {
        "rows_sent": pilot["rows"],
        "rows_weighed": navigator["weighed"],
        "rows_missed": navigator["missed"],
        "base_frames": int(base.get("frames", 0)),
        "base_bad": int(base.get("corrupt", 0)) + int(base.get("missed", 0)),
    }


def read_pairs(path: Path) -> set[tuple[int, int]]:
    """The (lane, tick) pairs of a CSV file."""
    with open(path, newline="") as file:
        return {(int(row["lane"]), int(row["tick"])) for row in csv.DictReader(file)}


def rounded(summary: dict) -> dict:
    """Floats to six decimals: the same digits on machines whose last bits differ."""
    return {key: _round(value) for key, value in summary.items()}


def _round(value):
    if isinstance(value, dict):
        return rounded(value)
    return round(value, 6) if isinstance(value, float) else value


def _share(part: int, whole: int) -> float:
    return part / whole if whole else 0.0
