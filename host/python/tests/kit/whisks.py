"""Body whisks by the formula, against posts at known radii."""

import math

import numpy as np

from crunchbot.touch.radial import model as radial
from crunchbot.touch.radial.model import Contact, Whisks

CONE_MM, TIP_MM = 181.7, 138.0
RADII = (90.0, 100.0, 110.0, 120.0, 130.0, TIP_MM)
RATE = math.pi / 24
COUNTS = 28_000.0  # of field, per rad of tilt


def whisk(radius_mm, rng, *, push_s=0.6, gain=1.0, speed=1.0, true_rate=None, hz=2000.0, channels=2, kappa=1.0):
    """One body whisk against a post: raw counts, commanded and reported rate."""
    x = radius_mm / CONE_MM
    tilt_rate = gain * RATE * speed * (true_rate or 1.0) * (1 - x) / (1 - x + kappa * x)
    t = np.arange(0.0, 0.2 + 2 * push_s + 0.3, 1 / hz)
    pushed = np.clip(np.minimum(t - 0.2, 0.2 + 2 * push_s - t), 0.0, None)
    along = np.array([0.8, -0.6, 0.3][:channels]) if channels > 1 else np.ones(1)
    counts = np.round(32768 + COUNTS * tilt_rate * pushed[:, None] * along + rng.normal(0, 11, (len(t), channels)))
    reported = np.full(len(t), RATE * speed * (true_rate or 1.0))
    return Contact(t, counts, np.full(len(t), RATE * speed), reported if true_rate else None)


def whisks(rng, repeats, spread=0.04, split="time", radii=RADII, **options) -> Whisks:
    """Whisks whose angle and gain spread alike; the angle through the duration or the rate."""
    recorded, truth = [], []
    for radius in radii:
        for _ in range(repeats):
            angle, gain = 1 + spread / math.sqrt(2) * rng.normal(size=2)
            how = {"push_s": 0.6 * angle} if split == "time" else {"true_rate": angle}
            recorded.append(whisk(radius, rng, gain=gain, **how, **options))
            truth.append(radius)
    peaks = np.array([radial.peak_of(c.samples) for c in recorded])
    return Whisks([str(n) for n in range(len(truth))], recorded, peaks, np.array(truth), 0)


def write_whisks(path, peaks, radii, header="contact,radius_mm,t_s,x,y"):
    lines = [header]
    for contact, (height, radius) in enumerate(zip(peaks, radii, strict=True)):
        for sample in range(100):
            bend = height * max(0.0, 1.0 - abs(sample - 60) / 30.0)
            lines.append(f"{contact},{radius},{sample * 5e-4},{1000 + 0.6 * bend},{2000 - 0.8 * bend}")
    path.write_text("\n".join(lines) + "\n")
