"""The contact filter in simulated contacts of known truth: place, normal, contour, speed, honesty, cost.

Writes bench/results/contact.json.
"""

import argparse
from pathlib import Path

import numpy as np
from tqdm import tqdm

from .. import store
from .measure import CASES, FIRST_S, contacts, follow, true_motion
from .scenes import TICK_S

CONTACTS = 20


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--each", type=int, default=CONTACTS, help="contacts of each kind")


def rms(values: np.ndarray) -> float | None:
    kept = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(kept**2))) if len(kept) else None


def summary(kind: str, found: list[dict]) -> dict:
    """Figures of one kind over all its contacts, from FIRST_S after the touch on."""

    def late(name: str) -> np.ndarray:
        return np.concatenate([one[name][one["late"]] for one in found])

    moves, shaped = true_motion(kind) == "sweep", kind.startswith(("face", "cylinder"))
    last = np.array([one["speed"][-1] for one in found if len(one["speed"])])
    refused, kept = (sum(one[name].sum() for one in found) for name in ("refused", "late"))
    reported = {
        "contacts": len(found),
        "refused": float(refused / (refused + kept)),
        "point_rms_mm": rms(late("off")),
        "point_median_mm": float(np.median(late("off"))),
        "bound_rms_mm": rms(late("least")),
        "bound_median_mm": float(np.median(late("least"))) if np.isfinite(late("least")).any() else None,
        "point_held_90": float(late("inside").mean()),
        "motion_right": float((late("motion") == true_motion(kind)).mean()),
        "corner": float(late("corner").mean()),
        "cost_us": float(np.mean([one["cost_us"] for one in found])),
    }
    if shaped:
        reported |= {"normal_rms_deg": rms(late("turn")), "normal_held_90": float(late("turn_inside").mean())}
        reported["contour_rms_mm"] = rms(late("contour"))
        taken = np.concatenate([one["taken"][one["late"]] for one in found])
        reported |= {"taken": float(taken.sum() / (refused + kept)), "taken_rms_deg": rms(late("turn")[taken])}
        reported["taken_within_15"] = float((np.abs(late("turn")[taken]) < 15.0).mean()) if taken.any() else None
    if moves:
        reported |= {
            "speed_median": float(np.median(np.abs(last))),
            "speed_within_10": float((np.abs(last) < 0.1).mean()),
        }
        reported["speed_held_90"] = float(np.mean([one["speed_inside"][-1] for one in found]))
    known = np.isfinite(late("slides"))
    if known.any():
        reported |= slip_figures(late("slip")[known], late("slides")[known])
    return reported


def slip_figures(slip: np.ndarray, slides: np.ndarray) -> dict[str, float]:
    """Stick or slip: share that sticks, share that is right, expected calibration error over five bins."""
    bins = np.minimum((5 * slip).astype(int), 4)
    gaps = [abs(np.sum(slip[bins == n] - slides[bins == n])) for n in range(5)]
    right = float(np.mean((slip > 0.5) == (slides > 0.5)))
    return {"sticks": float(1 - slides.mean()), "slip_right": right, "slip_ece": float(np.sum(gaps) / len(slip))}


def run(build: Path, each: int = CONTACTS) -> None:
    """Measure all kinds with the friction known and not, and against a chain of links in MuJoCo."""
    results: dict = {"tick_s": TICK_S, "first_s": FIRST_S, "kinds": {}}
    for name, case in CASES.items():
        for kind in case.kinds:
            made = tqdm(contacts(case, kind, each), desc=f"{name}: {kind}", total=each)
            found = [follow(case, kind, scene, least) for scene, least in made]
            results["kinds"].setdefault(name, {})[kind] = summary(kind, found)
    store.write_result("contact", rounded(results))


def rounded(value):
    """Numbers to four significant digits: that is more than repeats."""
    if isinstance(value, dict):
        return {key: rounded(part) for key, part in value.items()}
    if isinstance(value, list):
        return [rounded(part) for part in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value
