"""The contact filter in simulated contacts of known truth: place, normal, contour, speed, honesty, cost.

Writes bench/results/contact.json, docs/contact_results.md and docs/charts/contact_errors.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from .measure import FIRST_S, KINDS, TRUE_MOTION, contacts, follow
from .page import page
from .scenes import TICK_S

ROOT = Path(__file__).resolve().parents[3]
RESULTS, CHARTS = ROOT / "bench/results", ROOT / "docs/charts"
CONTACTS = 20
CASES = {
    "known": (True, False),
    "unknown": (False, False),
    "chain": (False, True),
}  # friction known; by a chain of links
SLICES_S = np.arange(0.02, 0.36, 0.02)


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--each", type=int, default=CONTACTS, help="contacts of each kind")


def rms(values: np.ndarray) -> float | None:
    kept = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(kept**2))) if len(kept) else None


def summary(kind: str, found: list[dict]) -> dict:
    """Figures of one kind over all its contacts, from FIRST_S after the touch on."""

    def late(name: str) -> np.ndarray:
        return np.concatenate([one[name][one["after_s"] >= FIRST_S] for one in found])

    moves, shaped = TRUE_MOTION[kind] == "sweep", kind.startswith(("face", "cylinder"))
    last = np.array([one["speed"][-1] for one in found if len(one["speed"])])
    told = {
        "contacts": len(found),
        "point_rms_mm": rms(late("off")),
        "point_median_mm": float(np.median(late("off"))),
        "bound_rms_mm": rms(late("least")) if not moves else None,
        "bound_median_mm": float(np.median(late("least"))) if np.isfinite(late("least")).any() else None,
        "point_held_90": float(late("inside").mean()),
        "motion_right": float((late("motion") == TRUE_MOTION[kind]).mean()),
        "corner": float(late("corner").mean()),
        "cost_us": float(np.mean([one["cost_us"] for one in found])),
    }
    if shaped:
        told |= {"normal_rms_deg": rms(late("turn")), "normal_held_90": float(late("turn_inside").mean())}
    if kind.startswith("cylinder"):
        told["contour_rms_mm"] = rms(late("contour"))
    if moves:
        told |= {"speed_median": float(np.median(np.abs(last))), "speed_within_10": float((np.abs(last) < 0.1).mean())}
        told["speed_held_90"] = float(np.mean([one["speed_inside"][-1] for one in found]))
    return told


def course(found: list[dict]) -> list[float | None]:
    """Median error of the point against time since the touch, mm."""
    after, off = (np.concatenate([one[name] for one in found]) for name in ("after_s", "off"))
    cells = [off[np.abs(after - t) < 0.5 * SLICES_S[0]] for t in SLICES_S]
    return [float(np.median(cell)) if len(cell) else None for cell in cells]


def draw(results: dict) -> Figure:
    figure = Figure(figsize=(8, 4.2), layout="constrained")
    axes = figure.subplots()
    styles = ["-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 2))]
    for (kind, values), style in zip(results["course"].items(), styles, strict=True):
        marker = "osv^Dx"[styles.index(style)]
        axes.plot(1e3 * SLICES_S, values, linestyle=style, marker=marker, markersize=4, color="0.15", label=kind)
    axes.axhline(1.0, color="0.6", linewidth=0.8)
    axes.set(yscale="log", xlabel="time since the touch (ms)", ylabel="median error of the contact's place (mm)")
    axes.grid(color="0.92")
    axes.legend(frameon=False, fontsize=8, ncols=2)
    return figure


def run(build: Path, fresh: bool, each: int = CONTACTS) -> None:
    """Measure all kinds with the friction known and not, and against a chain of links in MuJoCo."""
    results: dict = {"tick_s": TICK_S, "first_s": FIRST_S, "kinds": {}, "course": {}}
    for case, (known, links) in CASES.items():
        for kind in [k for k in KINDS if not links or TRUE_MOTION[k] != "sweep"]:  # chains are slow
            made = tqdm(contacts(kind, each, known, links), desc=f"{case}: {kind}", total=each)
            found = [follow(scene, least, known, links) for scene, least in made]
            results["kinds"].setdefault(case, {})[kind] = summary(kind, found)
            if case == "unknown":
                results["course"][kind] = course(found)
    for folder in (RESULTS, CHARTS):
        folder.mkdir(parents=True, exist_ok=True)
    (RESULTS / "contact.json").write_text(json.dumps(rounded(results), indent=1) + "\n")
    (ROOT / "docs/contact_results.md").write_text(page(results))
    figure = draw(results)
    figure.savefig(CHARTS / "contact_errors.svg", metadata={"Date": None})
    figure.savefig(CHARTS / "contact_errors.png", dpi=120)


def rounded(value):
    """Numbers to four significant digits: that is more than repeats."""
    if isinstance(value, dict):
        return {key: rounded(part) for key, part in value.items()}
    if isinstance(value, list):
        return [rounded(part) for part in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value
