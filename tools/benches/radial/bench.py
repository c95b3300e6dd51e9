"""Radial distance: errors, sureness, time and stability of the paper's line, a curve and presses.

Whiskers are drawn from a batch (stiffness, creep, friction, gain), calibrated with the paper's 5 whisks at 6 radii, and
judged on others.
"""

from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from crunchbot.touch.radial import model as radial
from crunchbot_lab.report.figures import SETTINGS
from crunchbot_lab.scenes.sweep import sweep
from crunchbot_lab.signals import pushes
from crunchbot_lab.signals.mechanics import LEAD_S
from crunchbot_lab.signals.world import TICK_S

from .. import store
from .trials import PAPER_MM, RADII_MM, SOURCES, SPOILS, SPREADS, Kind, Set, Whisker, recorded, spoilt

CACHE = store.kept("radial")
SEED = 48611  # chosen after the last change to the models; nothing was developed on these whiskers
METHODS = ("paper", "rational", "press", "default")
WHISKERS, FIT, HELD = 4, 5, 6  # whiskers of each spread; whisks at each radius
TIP_WHISKERS = 24  # of each spread: shares near 98 % ask for many whisks
LIMIT_MM, NEAR_MM = RADII_MM[-1] - 3.0, 3.0  # of tip and shaft; nearer to it nothing is asked


def rng_of(*path: int) -> np.random.Generator:
    return np.random.default_rng([SEED, *path])


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def fitted(name: str, cal: Set):
    """A model by its name; ValueError when the contacts do not determine one."""
    return radial.fit(cal.whisks, name).model


def reported(model, held: Set) -> list[radial.Estimate]:
    return [radial.estimate(model, c, f) for c, f in zip(held.whisks.recorded, held.whisks.peak_counts, strict=True)]


def with_truth(held: Set) -> Set:
    """What an oracle sees: the true rate of every push as the base's report."""
    contacts = [
        replace(c, reported_rad_s=np.full(len(c.t_s), rate))
        for c, rate in zip(held.whisks.recorded, held.true_rad_s, strict=True)
    ]
    return held._replace(whisks=replace(held.whisks, recorded=contacts))


def errors_of(kind_of, number: int) -> dict:
    """RMS error (mm) by spread and method, the oracle's too; coverage of the default's 50 % and 90 % intervals."""
    out = {}
    for k, spread in enumerate(SPREADS):
        kind = kind_of(spread)
        found = {name: [] for name in (*METHODS, "oracle")}
        inside = []
        for n in range(WHISKERS):
            rng, whisker = rng_of(number, k, n), Whisker.drawn(SEED + k, n)
            cal, held = recorded(whisker, kind, FIT, rng), recorded(whisker, kind, HELD, rng)
            for name in METHODS:
                answers = reported(fitted(name, cal), held)
                found[name].append(np.array([t.radius_mm for t in answers]) - held.whisks.radius_mm)
                if name == "default":
                    inside.append(np.abs(found[name][-1]) / np.array([t.sigma_mm for t in answers]))
            answers = reported(fitted("default", with_truth(cal)), with_truth(held))
            found["oracle"].append(np.array([t.radius_mm for t in answers]) - held.whisks.radius_mm)
        scores = {name: rms(np.concatenate(v)) for name, v in found.items()}
        scores |= {
            f"{name} worst whisker": max(map(rms, v)) for name, v in found.items() if name in ("default", "oracle")
        }
        z = np.concatenate(inside)
        out[f"{spread:g}"] = scores | {"coverage_50": np.mean(z < 0.6745), "coverage_90": np.mean(z < 1.645)}
    return out


def tips() -> dict:
    """Tip or shaft anywhere along the whisker but near the limit: share right."""
    out = {}
    for k, spread in enumerate(SPREADS):
        right = {name: [] for name in METHODS}
        for n in range(TIP_WHISKERS):
            rng, whisker = rng_of(20, k, n), Whisker.drawn(SEED + k, n)
            cal = recorded(whisker, Kind(spread), FIT, rng)
            held = recorded(whisker, Kind(spread, radii_mm=None), HELD, rng)
            asked = np.abs(held.whisks.radius_mm - LIMIT_MM) > NEAR_MM
            truth = held.whisks.radius_mm > LIMIT_MM
            for name in METHODS:
                said = np.array([t.type == "tip" for t in reported(fitted(name, cal), held)])
                right[name] += (said == truth)[asked].tolist()
        out[f"{spread:g}"] = {name: np.mean(r) for name, r in right.items()}
    return out


def stability() -> dict:
    """What broken samples do to each method: RMS error, median confidence and stated sigma, answers that are no
    number."""
    spread, out = SPREADS[1], {}
    for how in SPOILS:
        found = {name: [] for name in METHODS}
        for n in range(WHISKERS):
            rng = rng_of(30, n)
            whisker, neighbour = Whisker.drawn(SEED + 1, n), Whisker.drawn(SEED + 1, n + 100)
            cal, held = (recorded(whisker, Kind(spread), r, rng) for r in (FIT, HELD))
            others = recorded(neighbour, Kind(spread), HELD, rng)
            contacts = [
                spoilt(c, how, rng, o) for c, o in zip(held.whisks.recorded, others.whisks.recorded, strict=True)
            ]
            for name in METHODS:
                model = fitted(name, cal)
                found[name] += [
                    (*radial.estimate(model, c)[:4], r) for c, r in zip(contacts, held.whisks.radius_mm, strict=True)
                ]
        out[how] = {name: _stability_of(rows) for name, rows in found.items()}
    return out


def onsets() -> dict:
    """Pushes that go wrong, in the test alone or in every third contact of calibration too: share of sure answers, their RMS and
    worst error, mm."""
    out = {}
    for how in pushes.HOWS:
        for each in (0, 3):
            rows = []
            for k, spread in enumerate(SPREADS):
                for n in range(WHISKERS):
                    rng, whisker = rng_of(40, k, n), Whisker.drawn(SEED + k, n)
                    cal, held = (recorded(whisker, Kind(spread), r, rng) for r in (FIT, HELD))
                    lead = int(LEAD_S / TICK_S)
                    contacts = pushes.spoilt(cal.whisks.recorded, lead, how, rng, each)
                    model = radial.PressModel.fit(contacts, cal.whisks.radius_mm)
                    tests = pushes.spoilt(held.whisks.recorded, lead, how, rng)
                    rows += [
                        (t.confidence, t.radius_mm - r)
                        for t, r in zip((radial.estimate(model, c) for c in tests), held.whisks.radius_mm, strict=True)
                    ]
            confidence, off = np.array(rows).T
            sure = confidence > radial.PressModel.DOUBTED
            found = {"n": len(rows), "sure": np.mean(sure), "rms_mm": rms(off[sure])}
            found |= {"worst_mm": np.abs(off[sure]).max(), "beyond_10": int((np.abs(off[sure]) > 10.0).sum())}
            out.setdefault(how, {})["both" if each else "test"] = found
    return out


def _stability_of(rows: list) -> dict:
    mm, sigma, _type, sure, truth = (np.array(v) for v in zip(*rows, strict=True))
    numbers = np.isfinite(mm) & np.isfinite(sigma)
    return {
        "error_mm": rms((mm - truth)[numbers]),
        "sigma_mm": float(np.median(sigma)),
        "confidence": float(np.median(sure)),
        "not_a_number": int(np.count_nonzero(~numbers)),
    }


def fig5() -> dict:
    """The paper's calibration of four whiskers: 5 whisks at each radius, its standard errors, and one line for all."""
    points, all_peaks, all_radii = [], [], []
    for k, spread in enumerate(SPREADS):
        cal = recorded(Whisker.drawn(SEED, k), Kind(spread, "duration"), FIT, rng_of(50, k))
        model = fitted("paper", cal)
        points.append(
            {
                "radius_mm": cal.whisks.radius_mm.tolist(),
                "peak": cal.whisks.peak_counts.tolist(),
                "a1": model.a1,
                "a0": model.a0,
                "error_mm": model.sigma_mm,
            }
        )
        all_peaks += cal.whisks.peak_counts.tolist()
        all_radii += cal.whisks.radius_mm.tolist()
    return {"whiskers": points, "combined_mm": radial.RadialModel.fit(all_peaks, all_radii).sigma_mm}


PARTS = {  # the longest first: they run on all cores
    "tips": tips,
    "errors": lambda: {
        source: errors_of(lambda s, source=source: Kind(s, source), n) for n, source in enumerate(SOURCES)
    },
    "speeds": lambda: errors_of(lambda s: Kind(s, speeds=3.0), 10),
    "rates": lambda: {str(hz): errors_of(lambda s, hz=hz: Kind(s, hz=hz), 11) for hz in (100.0, 35.0)},
    "stability": stability,
    "onsets": onsets,
    "fig5": fig5,
}


def measured(part: str) -> dict:
    """One of PARTS."""
    return PARTS[part]()


def draw_fig5(results: dict) -> Figure:
    """As the paper's Fig. 5."""
    figure = Figure(figsize=(10.4, 3.2), layout="constrained")
    panels = figure.subplots(1, len(SPREADS), sharey=True, sharex=True)
    ends = np.array([85.0, 143.0])
    for n, (axes, w) in enumerate(zip(panels, results["fig5"]["whiskers"], strict=True)):
        axes.plot(w["radius_mm"], np.array(w["peak"]) * 180 / 65536, "o", mfc="none", color="#0b5394", ms=5)
        axes.plot(ends, (ends - w["a0"]) / w["a1"] * 180 / 65536, "k-", lw=1.2)
        axes.set_title(f"whisker {n + 1}: {w['error_mm']:.2f} mm (paper {PAPER_MM[n]:.2f})", fontsize=10)
        axes.set_xlabel("radial distance (mm)")
    panels[0].set_ylabel("peak deflection (degrees of field)")
    return figure


def run(_build: Path) -> None:
    """Measure what is not yet measured, and redraw. The C library comes with the Python module."""
    results = sweep(measured, {name: {"part": name} for name in PARTS}, CACHE, label="radial")
    points = results["fig5"]["whiskers"]
    kept = results | {
        "fig5": {"combined_mm": results["fig5"]["combined_mm"], "error_mm": [w["error_mm"] for w in points]}
    }
    store.write_result("radial", _rounded(kept))
    with matplotlib.rc_context(SETTINGS | {"svg.hashsalt": "whisker"}):
        store.write_chart("radial_fig5", draw_fig5(results))


def _rounded(values):
    if isinstance(values, dict):
        return {k: _rounded(v) for k, v in values.items()}
    if isinstance(values, list):
        return [_rounded(v) for v in values]
    return round(values, 4) if isinstance(values, float) else values
