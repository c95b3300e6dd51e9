#!/usr/bin/env python3
"""Whisker mechanics beside a chain of rigid links in MuJoCo: error of the base moment, natural frequencies, speed.

The chain (tools/mechanics_peers/chain.py) knows nothing of the simulator: an independent reference. Its 20-link results
are also written to sim/mechanics/tests/reference_table.h, where `make test` compares the simulator with them.
Speed: 28 whiskers at 2 kHz on one core, 4 against objects all the time, 8 dragged over floors, 16 free; ours and
MuJoCo's rounds take turns.
"""

import argparse
import hashlib
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "tools/mechanics_peers"
RESULTS, CHARTS = ROOT / "bench/results", ROOT / "docs/charts"
CACHE = ROOT / "build/bench/mechanics"
TABLE = ROOT / "sim/mechanics/tests/reference_table.h"
sys.path.insert(0, str(ROOT / "sim"))

LINKS = (5, 10, 20)
FINEST = 80  # links, for frequencies
ROUNDS = 3
OURS_S, MUJOCO_S = 20.0, 0.6  # simulated seconds a round
ANGLES = [2.5, 5.0, 7.5, *np.arange(10, 60, 5).tolist()]
EXIT, LENGTH, YOUNG, DENSITY = 1.30625e-3, 0.140, 2.5e9, 1200.0
STOP_FREE = 1e3  # no stop of the plug: MuJoCo's has none
SMALL_DEG = 5.0

# level -> title, forced level of whiskers against objects and on floors, sliding contacts, counts
LEVELS = {
    "closed": ("closed form", 1, 1, False, False),
    "large": ("large deflection", 2, 1, False, False),
    "closed_vibration": ("closed form, vibration", 5, 4, False, False),
    "large_vibration": ("large deflection, vibration", 6, 4, False, False),
    "auto": ("as the scene needs", -1, -1, False, False),
    "auto_sliding": ("as needed, contacts slide", -1, -1, True, False),
    "auto_counts": ("as needed, noise and counts too", -1, -1, False, True),
}


def cone(tip: float) -> float:
    return LENGTH / (1 - tip / EXIT)


def plug(kappa: float | None, tip: float) -> float | None:
    """Stiffness, N m/rad."""
    return None if kappa is None else kappa * 3 * YOUNG * np.pi * EXIT**4 / 64 / cone(tip)


def spec(tip: float, kappa: float | None, links: int, **more) -> dict:
    return {
        "length": LENGTH,
        "exit_diameter": EXIT,
        "cone": cone(tip),
        "young": YOUNG,
        "density": DENSITY,
        "plug": plug(kappa, tip),
        "links": links,
        **more,
    }


def static_cases() -> list[dict]:
    """Tip diameter, kappa, friction, distance."""
    rows = [(0.3e-3, kappa, 0.0, a) for kappa in (None, 1.0) for a in (80, 90, 100, 110, 120, 130, 135)]
    rows += [(0.3e-3, 3.0, 0.0, a) for a in (90, 120)]
    rows += [(0.3e-3, kappa, 0.3, a) for kappa in (None, 1.0) for a in (90, 110, 130)]
    rows += [(tip, kappa, 0.0, a) for tip in (0.2e-3, 0.6e-3, 0.9e-3) for kappa in (None, 1.0) for a in (90, 120)]
    return [{"tip": t, "kappa": k, "friction": f, "a": a * 1e-3} for t, k, f, a in rows]


def mode_cases() -> list[dict]:
    return [
        {"tip": tip, "kappa": kappa, "pinned_at": at}
        for tip in (0.3e-3, 0.6e-3)
        for kappa in (None, 1.0)
        for at in (0.0, 0.110, 0.140)
    ]


def python() -> Path:
    """The interpreter with MuJoCo, in a virtual environment of the bench's own."""
    folder = CACHE / "venv"
    found = folder / "bin/python"
    if not (folder / "ready").exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        install = [str(folder / "bin/pip"), "install", "--quiet", "--disable-pip-version-check", "--require-hashes"]
        subprocess.run([*install, "-r", str(SOURCES / "requirements.lock")], check=True)
        (folder / "ready").touch()
    return found


def chain(kind: str, job: dict) -> dict:
    """A result of the chain, kept once it is there."""
    text = json.dumps(job, sort_keys=True)
    kept = CACHE / "chain" / f"{kind}_{hashlib.sha256(text.encode()).hexdigest()[:16]}.json"
    if not kept.exists():
        kept.parent.mkdir(parents=True, exist_ok=True)
        done = subprocess.run([str(python()), str(SOURCES / "chain.py"), kind, text], capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"mechanics bench: chain.py {kind} failed: {done.stderr.strip().splitlines()[-1]}")
        kept.write_text(done.stdout)
    return json.loads(kept.read_text())


# ---------------------------------------------------------------------------------------------------------------------
# ours


def whisker_of(case: dict):
    from signals.mechanics import Whisker

    kappa = np.inf if case["kappa"] is None else case["kappa"]
    parameters = {"young": YOUNG, "density": DENSITY, "kappa": kappa, "stop": STOP_FREE}
    return Whisker(exit_diameter=EXIT, cone=cone(case["tip"]), friction=case.get("friction", 0.0), **parameters)


class Ours:
    """The simulator's levels by name: base moment at a peg (m, rad), swept up from the unbent whisker."""

    def __init__(self):
        from signals._sim import ffi, lib

        from signals.mechanics import _shared_table

        self.ffi, self.lib, self.table = ffi, lib, _shared_table()

    def closed(self, whisker, a: float, theta: float) -> float:
        return self.lib.mech_static_moment(whisker.c, a, theta)

    def large(self, whisker, a: float, theta: float) -> float:
        """NaN once slipped off."""
        hold, moment = self.ffi.new("struct mech_hold *"), self.ffi.new("double *")
        for part in np.linspace(0, theta, 101)[1:]:
            if not self.lib.mech_table_moment(self.table, whisker.c, a, part, hold, moment):
                return float("nan")
        self.arc = hold.arc * whisker.cone
        return moment[0]

    def slip_deg(self, whisker, a: float) -> float:
        hold, moment = self.ffi.new("struct mech_hold *"), self.ffi.new("double *")
        angles = np.arange(0.05, 90, 0.05)
        for angle in angles:
            if not self.lib.mech_table_moment(self.table, whisker.c, a, np.radians(angle), hold, moment):
                return float(angle)
        return float("inf")

    def elastica(self, whisker, a: float, theta: float) -> float:
        """The exact equation's moment with a plug, frictionless: bisection for the beam's own angle."""
        unit = self.lib.mech_whisker_bending(whisker.c) / whisker.cone
        bend = self.ffi.new("struct mech_bend *")
        low, high = 0.0, theta
        for _ in range(40 if np.isfinite(whisker.kappa) else 1):
            middle = (low + high) / 2 if np.isfinite(whisker.kappa) else theta
            there = self.lib.mech_elastica_at_angle(a / whisker.cone, middle, 0.0, 200, bend)
            if not there or middle + bend.moment / (3 * whisker.kappa) > theta:
                high = middle
            else:
                low = middle
        return unit * bend.moment if there else float("nan")

    def hertz(self, case: dict) -> list[float]:
        whisker, modes = whisker_of(case), self.ffi.new("struct mech_modes *")
        self.lib.mech_modes_of(whisker.c, modes)
        omega = list(modes.omega)
        if case["pinned_at"]:
            basis = self.ffi.new("struct mech_basis *")
            self.lib.mech_basis_of(whisker.c, modes, True, case["pinned_at"], 5e-4, basis)
            omega = list(basis.omega)
        return (np.sort(omega)[:3] / (2 * np.pi)).tolist()


def measure_static(ours: Ours, bar) -> list[dict]:
    """Per case: what 20 links say, and the levels' errors against it."""
    rows = []
    for case in static_cases():
        angles = ANGLES[1:] if case["friction"] else ANGLES  # the first touch takes time to settle
        wanted = {"friction": case["friction"], "a": case["a"], "angles_deg": angles}
        found = chain("static", spec(case["tip"], case["kappa"], 20, **wanted))
        whisker = whisker_of(case)
        points = []
        for row in found["rows"]:
            large = ours.large(whisker, row["a"], row["theta"])
            points.append(
                {
                    "theta_deg": float(np.degrees(row["theta"])),
                    "chain": row,
                    "large": large / row["moment"] - 1,
                    "closed": ours.closed(whisker, row["a"], row["theta"]) / row["moment"] - 1,
                    "arc_mm": 1e3 * (ours.arc - row["arc"]),
                }
            )
        slip = found["slipped_deg"]
        rows.append(case | {"points": points, "chain_slips_deg": slip, "slips_deg": ours.slip_deg(whisker, case["a"])})
        bar.update()
    return rows


def measure_links(ours: Ours, bar) -> list[dict]:
    """Error of 5, 10 and 20 links against the exact elastica, in a plug with kappa 1."""
    rows = []
    for links in LINKS:
        points = []
        for a in (80, 100, 120, 130):
            case = {"tip": 0.3e-3, "kappa": 1.0, "friction": 0.0, "a": a * 1e-3}
            job = spec(case["tip"], 1.0, links, friction=0.0, a=case["a"], angles_deg=ANGLES)
            whisker = whisker_of(case)
            for row in chain("static", job)["rows"]:
                exact = ours.elastica(whisker, row["a"], row["theta"])
                errors = {"chain": row["moment"] / exact - 1}
                errors |= {
                    name: getattr(ours, name)(whisker, row["a"], row["theta"]) / exact - 1
                    for name in ("closed", "large")
                }
                points.append({"a": a, "theta_deg": float(np.degrees(row["theta"])), **errors})
        rows.append({"links": links, "points": points})
        bar.update()
    return rows


def measure_modes(ours: Ours, bar) -> list[dict]:
    rows = []
    for case in mode_cases():
        row = case | {"ours_hz": ours.hertz(case), "chain_hz": {}}
        for links in (*LINKS, FINEST):
            job = spec(case["tip"], case["kappa"], links, pinned_at=case["pinned_at"])
            row["chain_hz"][links] = chain("modes", job)["hz"][:3]
        rows.append(row)
        bar.update()
    return rows


def run_scene(ours: Ours, level: str) -> dict:
    _, shaft, drag, sliding, counts = LEVELS[level]
    setting = {"shaft_level": shaft, "drag_level": drag, "sliding": sliding, "counts": counts, "tick_s": 500e-6}
    scene = ours.lib.sim_mechanics_scene_new(ours.ffi.new("struct sim_mechanics_setting *", setting), 11)
    ours.lib.sim_mechanics_scene_run(scene, 4000)
    started = time.process_time()
    ours.lib.sim_mechanics_scene_run(scene, round(OURS_S / 500e-6))
    spent = time.process_time() - started
    share = ours.ffi.new("double[2]")
    ours.lib.sim_mechanics_scene_levels(scene, share)
    ours.lib.sim_mechanics_scene_free(scene)
    return {"times_real": OURS_S / spent, "large": share[0], "vibrating": share[1]}


def measure_speed(ours: Ours, bar) -> dict:
    """Median of rounds in turn; all on one core."""
    found: dict[str, list[dict]] = {}
    for turn in range(ROUNDS):
        for level in LEVELS:
            found.setdefault(level, []).append(kept_round(level, turn, lambda level=level: run_scene(ours, level)))
        for links in LINKS:
            name, job = f"mujoco_{links}", spec(0.3e-3, 1.0, links, seconds=MUJOCO_S)
            found.setdefault(name, []).append(chain("speed", job | {"turn": turn}))
        bar.update()
    return {name: median_of(rounds) for name, rounds in found.items()}


def kept_round(level: str, turn: int, measure) -> dict:
    kept = CACHE / "speed" / f"{level}_{turn}.json"
    if not kept.exists():
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(measure()))
    return json.loads(kept.read_text())


def median_of(rounds: list[dict]) -> dict:
    middle = sorted(rounds, key=lambda one: one["times_real"])[len(rounds) // 2]
    return middle | {"rounds": [one["times_real"] for one in rounds]}


# ---------------------------------------------------------------------------------------------------------------------
# what is kept


def worst(points: list[dict], name: str, largest_deg: float) -> float:
    """Largest error in percent up to an angle."""
    errors = [abs(p[name]) for p in points if p["theta_deg"] <= largest_deg and np.isfinite(p[name])]
    return 100 * max(errors)


def before_slip(row: dict) -> list[dict]:
    """Points up to 95 % of the angle where either lets go: beyond it a small difference decides."""
    ends = [row["slips_deg"], row["chain_slips_deg"] or np.inf]
    return [p for p in row["points"] if p["theta_deg"] <= 0.95 * min(ends)]


def summary(static: list[dict], modes: list[dict], speed: dict) -> dict:
    kept = [p for row in static for p in before_slip(row)]
    hertz = [abs(np.array(r["ours_hz"]) / r["chain_hz"][FINEST] - 1).max() for r in modes]
    return {
        "cases": len(static),
        "points": len(kept),
        "large_worst_percent": max(100 * abs(p["large"]) for p in kept),
        "large_rms_percent": 100 * float(np.sqrt(np.mean([p["large"] ** 2 for p in kept]))),
        "closed_worst_percent_to_5_deg": worst(kept, "closed", SMALL_DEG + 0.1),
        "arc_worst_mm": max(abs(p["arc_mm"]) for p in kept),
        "frequency_worst_percent": 100 * float(max(hertz)),
        "times_real": {name: round(found["times_real"], 2) for name, found in speed.items()},
    }


def write_table(static: list[dict], modes: list[dict]) -> None:
    """The C table that `make test` compares with."""
    lines = [
        "/* Made by tools/bench_mechanics.py with a 20-link chain in MuJoCo; do not edit. Statics: tip diameter mm, kappa (0:",
        " * clamped), friction, peg's distance mm and angle rad, base moment uN m, arc length of the contact mm. Modes: tip",
        " * diameter mm, kappa, pinned at mm (0: free), three frequencies Hz. */",
        "/* clang-format off */",
        "static const double CHAIN_STATIC[][7] = {",
    ]
    for row in static:
        for p in before_slip(row):
            c = p["chain"]
            values = (row["tip"] * 1e3, row["kappa"] or 0, row["friction"], c["a"] * 1e3, c["theta"], c["moment"] * 1e6)
            lines.append("    {" + ", ".join(f"{v:.7g}" for v in (*values, c["arc"] * 1e3)) + "},")
    lines += ["};", "static const double CHAIN_MODES[][6] = {"]
    for row in modes:
        values = (row["tip"] * 1e3, row["kappa"] or 0, row["pinned_at"] * 1e3, *row["chain_hz"][20])
        lines.append("    {" + ", ".join(f"{v:.7g}" for v in values) + "},")
    TABLE.write_text("\n".join([*lines, "};", "/* clang-format on */"]) + "\n")


# ---------------------------------------------------------------------------------------------------------------------
# figures

STYLES = {
    "closed": {"color": "#6b6b6b", "marker": "s"},
    "large": {"color": "#0b5394", "marker": "o"},
    "closed_vibration": {"color": "#6b6b6b", "marker": "D"},
    "large_vibration": {"color": "#0b5394", "marker": "v"},
    "auto": {"color": "#38761d", "marker": "*"},
}
CHAINS = {
    5: {"color": "#c25700", "marker": "^"},
    10: {"color": "#c25700", "marker": "<"},
    20: {"color": "#c25700", "marker": ">"},
}
STATIC_OF = {"closed": "closed", "closed_vibration": "closed"}  # the others: large


def draw_speed(data: dict) -> Figure:
    """Error of the base moment against speed."""
    figure = Figure(figsize=(10.5, 4.6), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, largest, title in zip(panels, (SMALL_DEG + 0.1, 90), ("up to 5 degrees", "up to slip-off"), strict=True):
        for row in data["links"]:
            name = f"mujoco_{row['links']}"
            error = worst(row["kept"], "chain", largest)
            axes.plot(
                data["speed"][name]["times_real"],
                error,
                label=f"MuJoCo, {row['links']} links",
                markersize=8,
                linestyle="",
                **CHAINS[row["links"]],
            )
        for level, style in STYLES.items():
            error = (
                auto_error(data, largest)
                if level == "auto"
                else worst(data["links"][-1]["kept"], STATIC_OF.get(level, "large"), largest)
            )
            size = 13 if level == "auto" else 8
            hollow = {} if "vibration" in level or level == "auto" else {"markerfacecolor": "none"}
            axes.plot(
                data["speed"][level]["times_real"],
                error,
                label=LEVELS[level][0],
                markersize=size,
                linestyle="",
                **style,
                **hollow,
            )
        axes.axvline(200, color="0.6", linewidth=0.8, linestyle="--")
        axes.axhline(5, color="0.6", linewidth=0.8, linestyle=":")
        axes.set(xscale="log", yscale="log", title=title, xlabel="times real time, 28 whiskers at 2 kHz, one core")
        axes.grid(color="0.92")
    panels[0].set_ylabel("largest error of the base moment (%)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle(
        "Contacts at 80-130 mm against the exact elastica, plug kappa 1. Dashed: 200 times real; dotted: 5 %",
        fontsize=10,
    )
    return figure


def auto_error(data: dict, largest: float) -> float:
    """The chosen level's error: the closed form's where its bound is below the tolerance, else the large deflection's."""
    points = [p | {"auto": p["closed"] if p["trusted"] else p["large"]} for p in data["links"][-1]["kept"]]
    return worst(points, "auto", largest)


def draw_moment(data: dict) -> Figure:
    """Base moment against angle, the chain's points over the levels' curves."""
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, kappa, title in zip(panels, (None, 1.0), ("clamped", "plug, kappa 1"), strict=True):
        for a, style in ((0.090, "-"), (0.110, "--"), (0.130, "-.")):
            row = next(
                r for r in data["static"] if (r["kappa"], r["a"], r["friction"], r["tip"]) == (kappa, a, 0.0, 0.3e-3)
            )
            shown = [p for p in row["points"] if np.isfinite(p["large"])]
            angle = [p["theta_deg"] for p in shown]
            chained = np.array([p["chain"]["moment"] * 1e6 for p in shown])
            axes.plot(
                angle,
                chained * (1 + np.array([p["large"] for p in shown])),
                style,
                color="#0b5394",
                label=f"large deflection, {a * 1e3:.0f} mm",
            )
            axes.plot(
                angle, chained * (1 + np.array([p["closed"] for p in shown])), style, color="#9a9a9a", linewidth=1
            )
            axes.plot(
                angle, chained, "x", color="#c25700", markersize=5, label="MuJoCo, 20 links" if a == 0.130 else None
            )
            axes.plot(row["slips_deg"], 0, "v", color="#0b5394", clip_on=False, markersize=6)
        axes.set(title=title, xlabel="imposed angle (degrees)", ylim=(0, 2700))
        axes.grid(color="0.92")
    panels[0].set_ylabel("base moment (uN m)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle(
        "Frictionless peg. Grey: closed form; triangles: where the simulator lets the whisker slip off", fontsize=10
    )
    return figure


def save(data: dict) -> None:
    for folder in (RESULTS, CHARTS):
        folder.mkdir(parents=True, exist_ok=True)
    (RESULTS / "mechanics.json").write_text(json.dumps(data, indent=1) + "\n")
    for name, draw in (("speed", draw_speed), ("moment", draw_moment)):
        figure = draw(data)
        figure.savefig(CHARTS / f"mechanics_{name}.svg", metadata={"Date": None})
        figure.savefig(CHARTS / f"mechanics_{name}.png", dpi=120)
    print("bench/results/mechanics.json, docs/charts/mechanics_speed.svg, mechanics_moment.svg")


def keep(ours: Ours, links: list[dict]) -> None:
    """Marks what is before slip-off, and where the closed form is trusted at the default tolerance."""
    relative = ours.lib.mech_tolerance_default().relative
    for row in links:
        row["kept"] = []
        for p in row["points"]:
            whisker = whisker_of({"tip": 0.3e-3, "kappa": 1.0})
            a, theta = p["a"] * 1e-3, np.radians(p["theta_deg"])
            trust = ours.lib.mech_table_trust(ours.table, whisker.c, a)
            bent = theta - ours.lib.mech_static_tilt(whisker.c, a, theta)
            p["trusted"] = bool(
                (trust.curvature * bent + trust.friction) * bent <= relative and bent <= 0.5 * trust.limit
            )
            if p["theta_deg"] <= 0.95 * ours.slip_deg(whisker, a):
                row["kept"].append(p)


def run(build: Path, fresh: bool) -> None:
    """Measure what is not measured yet, and redraw. The simulator is the one that tools/build.sh has built."""
    matplotlib.rcParams["svg.hashsalt"] = "whisker"
    if fresh:
        for folder in ("chain", "speed"):
            shutil.rmtree(CACHE / folder, ignore_errors=True)
    ours = Ours()
    with tqdm(total=len(static_cases()) + len(LINKS) + len(mode_cases()) + ROUNDS, desc="mechanics") as bar:
        speed = measure_speed(ours, bar)
        modes = measure_modes(ours, bar)
        static = measure_static(ours, bar)
        links = measure_links(ours, bar)
    keep(ours, links)
    data = {"summary": summary(static, modes, speed), "speed": speed, "modes": modes, "static": static, "links": links}
    data["mujoco"] = chain("modes", spec(0.3e-3, 1.0, 20, pinned_at=0.0))["mujoco"]
    write_table(static, modes)
    save(data)
    print(json.dumps(data["summary"], indent=1))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release")
    parser.add_argument("--fresh", action="store_true", help="forget what an interrupted run has measured")
    options = parser.parse_args()
    run(options.build_dir.resolve(), options.fresh)
    return 0


if __name__ == "__main__":
    sys.exit(main())
