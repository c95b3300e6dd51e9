"""A real whisker pressed at known places: public recordings that a user gives, places and whole runs left out."""

import re
from pathlib import Path

import numpy as np
from tqdm import tqdm

from crunchbot.touch.radial import model as radial
from crunchbot.touch.radial.model import Contact, Whisks, peak_of
from crunchbot.touch.radial.press import press_of

METHODS = ("paper", "quadratic", "rational", "whisk", "press", "default")
HZ = 116.6  # 100 mm of travel at 10 mm/s in 1166 samples
NAME = re.compile(r"(\d+)d-\d+x-10y-1cms-(val|test)\.csv")
BEFORE, AFTER, LEAST = 200, 100, 500  # samples kept before and after a push; of a push
DEPTHS_MM = (10.0, 20.0, None)  # of the press from its onset; None: the whole recording
ONSET_WINDOW_MM = 6.0


def presses(folder: Path, direction: int, run: str) -> Whisks:
    """Contacts of one direction and run ("val" or "test"): three pressures, depth of travel, place in mm."""
    recorded, places = [], []
    for path in sorted(folder.iterdir()):
        match = NAME.fullmatch(path.name)
        if not match or int(match[1]) != direction or match[2] != run:
            continue
        rows = np.genfromtxt(path, delimiter=",", skip_header=1)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], (rows[:, 3] > 0.02).astype(int), [0]])))
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            if last - first < LEAST:
                continue
            part = rows[max(0, first - BEFORE) : last + AFTER]
            recorded.append(Contact(np.arange(len(part)) / HZ, part[:, :3], depth_mm=part[:, 3]))
            places.append(10.0 * rows[0, 4])
    peaks = np.array([peak_of(contact.samples) for contact in recorded])
    return Whisks([str(n) for n in range(len(places))], recorded, peaks, np.array(places), 0)


def directions(folder: Path) -> list[int]:
    found = {int(match[1]) for path in folder.iterdir() if (match := NAME.fullmatch(path.name))}
    if not found:
        raise SystemExit(f"{folder}: no recordings named like 0d-5x-10y-1cms-val.csv; give the folder 'dataset'")
    return sorted(found)


def real_whisker(folder: Path) -> dict:
    """Mean absolute error, mm, and the share that the stated 90 % interval holds, by direction, protocol and method."""
    out = {}
    for direction in directions(folder):
        runs = {run: presses(folder, direction, run) for run in ("val", "test")}
        pairs = {"other run": [(runs["val"], runs["test"]), (runs["test"], runs["val"])], "other place": []}
        for place in np.unique(runs["val"].radius_mm):
            kept = np.flatnonzero(runs["val"].radius_mm != place)
            held = np.flatnonzero(runs["test"].radius_mm == place)
            pairs["other place"].append((runs["val"].part(kept), runs["test"].part(held)))
        out[str(direction)] = {
            what: {name: scores(name, some) for name in tqdm(METHODS, desc=f"{direction} degrees, {what}", leave=False)}
            for what, some in pairs.items()
        }
    return out


def scores(name: str, pairs: list[tuple[Whisks, Whisks]]) -> dict:
    found: dict[str, list] = {}
    for calibration, held in pairs:
        try:
            model = radial.fit(calibration, name).model
        except ValueError:
            return {}
        for contact, place in zip(held.recorded, held.radius_mm, strict=True):
            for depth in DEPTHS_MM if isinstance(model, radial.PressModel) else (None,):
                answer = radial.estimate(model, _until(contact, depth))
                key = "whole" if depth is None else f"after {depth:g} mm"
                found.setdefault(key, []).append((answer.radius_mm - place, answer.sigma_mm))
    return {key: _scores(np.array(rows)) for key, rows in found.items()}


def _until(contact: Contact, depth_mm: float | None) -> Contact:
    """The contact up to a depth from its onset, which is found in the whole recording."""
    press = press_of(contact, ONSET_WINDOW_MM) if depth_mm is not None else None
    if press is None:
        return contact
    onset = contact.depth_mm.max() - press.depth[-1]
    return contact.until(int(np.argmax(contact.depth_mm >= onset + depth_mm)))


def _scores(rows: np.ndarray) -> dict:
    off = np.abs(rows[:, 0])
    return {"error_mm": off.mean(), "held_90": np.mean(off < 1.645 * rows[:, 1]), "contacts": len(rows)}
