"""Data of one's own through both models of touch: what surface a whisker sweeps over, and how far out it is touched.

Usage: whisker examples; python own_touch.py [FOLDER]   (default: examples)

FOLDER holds surfaces/NAME/*.csv (t_s and channels; a folder for each surface, two recordings or more) and contacts.csv
(contact, radius_mm, t_s, channels), as docs/formats.md says. The last recording of each surface and every third contact are
held out: the figures are of those.
"""

import sys
from pathlib import Path

import numpy as np

from crunchbot.touch.radial import model as radial
from crunchbot.touch.texture import model as texture
from crunchbot.touch.texture import train as texture_train

HELD_OUT = 3  # one contact of so many


def textures(folder: Path) -> float:
    """Share of the held-out windows of 100 ms that are named rightly; prints a line for each surface."""
    recordings, rate_hz = texture.read_training(folder)
    model = texture_train.train({name: group[:-1] for name, group in recordings.items()}, rate_hz)
    right = windows = 0
    for name, group in recordings.items():
        t_s = np.arange(len(group[-1])) / rate_hz
        named = [decision.label for decision in texture.classify(model, t_s, group[-1])]
        print(f"{name}: {named.count(name)} of {len(named)} windows right, {named.count('unknown')} unknown")
        right, windows = right + named.count(name), windows + len(named)
    return right / windows


def contacts(path: Path, kind: str = "paper") -> float:
    """Root mean square error of the held-out contacts, mm; `kind` is one of radial.MODELS."""
    whisks = radial.read_whisks(path, with_radius=True)
    count = len(whisks.contact)
    out = np.arange(HELD_OUT - 1, count, HELD_OUT)
    model = radial.fit(whisks.part(np.setdiff1d(np.arange(count), out)), kind).model
    held = whisks.part(out)
    answers = [radial.estimate(model, *one) for one in zip(held.recorded, held.peak_counts, strict=True)]
    errors = np.array([answer.radius_mm for answer in answers]) - held.radius_mm
    rms, sigma = np.sqrt(np.mean(errors**2)), np.mean([answer.sigma_mm for answer in answers])
    print(f"{kind}: {len(errors)} contacts held out, rms error {rms:.2f} mm, the model says {sigma:.2f} mm")
    return float(rms)


def main(folder: Path = Path("examples")) -> tuple[float, dict[str, float]]:
    """Share of windows right; errors in mm by model."""
    return textures(folder / "surfaces"), {k: contacts(folder / "contacts.csv", k) for k in ("paper", "default")}


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
