"""What the bench measures: the chain's answers, the simulator's beside them, and the speed of both."""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from .. import store

ROOT = Path(__file__).resolve().parents[3]
SOURCES = ROOT / "tools/benches/mechanics/peers"
BUILT, CACHE = store.BENCH / "mechanics", store.kept("mechanics")
# The chain knows nothing of the simulator: its answers stand as long as it does.
CHAIN = store.kept("chain of links", "tools/benches/mechanics/peers", "tools/benches/contact/peers")

LINKS = (5, 10, 20)
FINEST = 80  # links, for frequencies
ANGLES = [2.5, 5.0, 7.5, *np.arange(10, 60, 5).tolist()]
EXIT, LENGTH, YOUNG, DENSITY = 1.30625e-3, 0.140, 2.5e9, 1200.0
STOP_FREE = 1e3  # no stop of the plug: MuJoCo's has none
SMALL_DEG = 5.0


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
    folder = BUILT / "venv"
    found = folder / "bin/python"
    if not (folder / "ready").exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        install = [str(folder / "bin/pip"), "install", "--quiet", "--disable-pip-version-check", "--require-hashes"]
        subprocess.run([*install, "-r", str(SOURCES / "requirements.lock")], check=True)
        (folder / "ready").touch()
    return found


def chain(kind: str, job: dict, program: Path = SOURCES / "chain.py") -> dict:
    """A result of the chain, kept once it is there."""
    text = json.dumps(job, sort_keys=True)
    # What is timed is timed anew in another state of the tree: ours takes turns with it.
    folder = CACHE / "chain" if kind == "speed" else CHAIN

    def solved() -> dict:
        done = subprocess.run([str(python()), str(program), kind, text], capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"bench: {program.name} {kind} failed: {done.stderr.strip().splitlines()[-1]}")
        return json.loads(done.stdout)

    return store.once(folder / f"{kind}_{hashlib.sha256(text.encode()).hexdigest()[:16]}.json", solved)


def whisker_of(case: dict):
    from crunchbot_lab.signals.mechanics import Whisker

    kappa = np.inf if case["kappa"] is None else case["kappa"]
    parameters = {"young": YOUNG, "density": DENSITY, "kappa": kappa, "stop": STOP_FREE}
    return Whisker(exit_diameter=EXIT, cone=cone(case["tip"]), friction=case.get("friction", 0.0), **parameters)


class Ours:
    """The simulator's levels by name: base moment at a peg (m, rad), swept up from the unbent whisker."""

    def __init__(self):
        from crunchbot_lab.signals._sim import ffi, lib

        from crunchbot_lab.signals.mechanics import _shared_table

        self.ffi, self.lib, self.table = ffi, lib, _shared_table()

    def closed(self, whisker, a: float, theta: float) -> float:
        return self.lib.mech_whisker_moment(whisker.c, a, theta)

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
