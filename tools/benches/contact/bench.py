"""The contact filter in contacts of known truth: place, normal, speed, honesty, cost; each draw by the hash of a word.

Writes bench/results/contact.json.
"""

import argparse
import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from tqdm import tqdm

from .. import store
from .measure import BLOCK, CASES, FIRST_S, contact, drawn, first_touch, true_motion
from .scenes import FRICTION, TICK_S, chained

CONTACTS, WORD = 40, "judged"
PROCESSORS = 2
STORED = (
    "ellipse",
    "wedge, its edge on the shaft",
    "face, across the whisker",
    "short face, any angle",
    "face, head-on",
)
DRAWS = ("number", "friction", "median mm", "worst mm", "held 90", "refused", "normal median deg", "normals taken")


def options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--each", type=int, default=CONTACTS, help="contacts of each kind")
    parser.add_argument("--word", default=WORD, help="another word gives other draws")
    parser.add_argument(
        "--contacts", type=Path, metavar="FILE", help="write the tests' contacts there, measure nothing"
    )


def rms(values: np.ndarray) -> float | None:
    kept = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(kept**2))) if len(kept) else None


def median(values: np.ndarray) -> float | None:
    return float(np.median(np.abs(values))) if len(values) and np.isfinite(values).all() else None


def summary(kind: str, found: list[dict]) -> dict:
    """Figures of one kind over the reports of all its contacts, from FIRST_S after the touch on."""

    def late(name: str) -> np.ndarray:
        return np.concatenate([one[name][one["late"]] for one in found])

    refused, kept = (sum(one[name].sum() for one in found) for name in ("refused", "late"))
    reported = {
        "contacts": len(found),
        "refused": float(refused / (refused + kept)),
        "cost_us": float(np.mean([one["cost_us"] for one in found])),
    }
    if true_motion(kind) == "sweep":
        last = np.array([one["speed"][-1] for one in found if len(one["speed"])])
        reported |= {"speed_median": median(last), "speed_within_10": float((np.abs(last) < 0.1).mean())}
        reported["speed_held_90"] = float(np.mean([one["speed_inside"][-1] for one in found]))
    if not kept:
        return reported
    reported |= {
        "point_rms_mm": rms(late("off")),
        "point_median_mm": median(late("off")),
        "point_worst_mm": float(late("off").max()),
        "bound_rms_mm": rms(late("least")),
        "bound_median_mm": median(late("least")),
        "point_held_90": float(late("inside").mean()),
        "motion_right": float((late("motion") == true_motion(kind)).mean()),
        "corner": float(late("corner").mean()),
    }
    if np.isfinite(late("turn")).all():
        reported |= normal_figures(late("turn"), late("turn_inside"), late("published_inside"), late("taken"))
        reported |= {"taken": float(late("taken").sum() / (refused + kept)), "contour_rms_mm": rms(late("contour"))}
    known = np.isfinite(late("slides"))
    if known.any():
        reported |= slip_figures(late("slip")[known], late("slides")[known])
    return reported


def normal_figures(
    turn: np.ndarray, inside: np.ndarray, published: np.ndarray, taken: np.ndarray
) -> dict[str, float | None]:
    """`published`: within the region that a pilot publishes."""
    return {
        "normal_median_deg": median(turn),
        "normal_rms_deg": rms(turn),
        "normal_held_90": float(inside.mean()),
        "taken_median_deg": median(turn[taken]),
        "taken_rms_deg": rms(turn[taken]),
        "taken_worst_deg": float(np.abs(turn[taken]).max()) if taken.any() else None,
        "taken_held_90": float(published[taken].mean()) if taken.any() else None,
    }


def slip_figures(slip: np.ndarray, slides: np.ndarray) -> dict[str, float]:
    """Stick or slip: share that sticks, share that is right, expected calibration error over five bins."""
    bins = np.minimum((5 * slip).astype(int), 4)
    gaps = [abs(np.sum(slip[bins == n] - slides[bins == n])) for n in range(5)]
    right = float(np.mean((slip > 0.5) == (slides > 0.5)))
    return {"sticks": float(1 - slides.mean()), "slip_right": right, "slip_ece": float(np.sum(gaps) / len(slip))}


def row(number: int, one: dict | None) -> list:
    """A draw, by DRAWS; only its number where nothing was felt for long enough."""
    if one is None:
        return [number]
    late, refused = one["late"], int(one["refused"].sum())
    off, turn = one["off"][late], one["turn"][late]
    worst, held = (float(off.max()), float(one["inside"][late].mean())) if late.any() else (None, None)
    share = refused / max(refused + int(late.sum()), 1)
    return [number, one["friction"], median(off), worst, held, share, median(turn), int(one["taken"][late].sum())]


def stored(each: int, word: str) -> list[dict]:
    """Contacts of the kinds at any angle as tests keep them: of each block its mean tilt, and the truth in its middle."""
    made = []
    for kind in STORED:
        for number in range(each):
            scene = chained(*drawn(kind, word, number))
            if scene is None:
                continue
            start = first_touch(scene)
            count = (len(scene.tilt) - start) // BLOCK
            middles = start + BLOCK // 2 + BLOCK * np.arange(count)
            tilt = scene.tilt[start : start + BLOCK * count].reshape(count, BLOCK, 2).mean(axis=1)
            rows = np.column_stack([tilt, scene.point[middles], scene.normal[middles]]).round(6).tolist()
            made.append({"kind": kind, "number": number, "base": scene.bases[start].round(6).tolist(), "rows": rows})
    return made


def run(build: Path, each: int = CONTACTS, word: str = WORD, contacts: Path | None = None) -> None:
    """Measure all kinds by the simulator of corners and by a chain of links in MuJoCo."""
    if contacts is not None:
        contacts.write_text("".join(f"{json.dumps(one)}\n" for one in stored(each, word)))
        return
    results: dict = {
        "tick_s": TICK_S,
        "first_s": FIRST_S,
        "friction": FRICTION,
        "word": word,
        "draws": DRAWS,
        "kinds": {},
    }
    for name, case in CASES.items():
        for kind in case.kinds:
            with ThreadPoolExecutor(PROCESSORS) as pool:
                made = pool.map(lambda n, case=case, kind=kind: contact(case, kind, word, n), range(each))
                found = list(tqdm(made, desc=f"{name}: {kind}", total=each))
            figures = summary(kind, [one for one in found if one is not None])
            figures["each"] = [row(n, one) for n, one in enumerate(found)]
            results["kinds"].setdefault(name, {})[kind] = figures
    store.write_result("contact", rounded(results))


def rounded(value):
    """Numbers to four significant digits: that is more than repeats."""
    if isinstance(value, dict):
        return {key: rounded(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(part) for part in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value
