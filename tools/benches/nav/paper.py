"""Repeats what the CrunchBot paper shows and says of its navigation: Fig. 6a, b, c, and the banana.

    make bench, or .venv/bin/python tools/benches nav_paper

Likelihoods and filters are host/nav's; the arena is drawn at random, as the paper does not give its own. Writes
bench/results/nav_paper.json and docs/charts/nav_fig6a, nav_fig6b, nav_fig6c, nav_banana.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from crunchbot.nav import localise
from crunchbot.nav.filters import Filter
from crunchbot.nav.observations import Observations
from crunchbot.nav.scoring import lock_row, position_errors
from crunchbot.nav.weigher import Weigher
from crunchbot.scene import Arena, Prior, Scene
from crunchbot_lab import scenes
from crunchbot_lab.scenes.making import make_recipe
from crunchbot_lab.scenes.readings import World

from .. import store
from . import paper_charts as charts

ROOT = Path(__file__).resolve().parents[3]
CACHE = store.kept("nav_paper")
CELLS, DIAMETER_M, SPAN_RAD = 11, 0.25, math.pi / 2  # the paper's fovea
SPACING_M, SPACING_RAD = DIAMETER_M / (CELLS - 1), SPAN_RAD / (CELLS - 1)
FIGURE_SEED = 9001
PRIOR_OFF, PRIOR_SIGMA = (-0.05, 0.05, math.radians(9)), (0.06, 0.06, math.radians(12))
ROW_S = 0.1
CROSS = {"wrong_m": 0.2, "step_m": 0.02, "rows": 30, "start_m": 0.7, "border_m": 1.0, "tip_m": 0.05}
FILTERS_6C = {
    "foveal, eq. 7 weighted": ("foveal", {}),
    "foveal, eq. 7 as printed": ("foveal", {"foveal.printed": 1.0}),
    "foveal, inflated": ("foveal", {"foveal.inflate": 1.0}),
    "particle, 2000": ("particle", {"particle.count": 2000.0}),
    "grid, 2.5 cm x 5 deg": ("grid", {"grid.cell_m": 0.025, "grid.cell_deg": 5.0}),
}
# Way in m after a start known to 2 cm and so many degrees; the turn comes first.
MOTIONS = [
    (way, turn, start)
    for start in (2.0, 10.0, 25.0)
    for way, turn in ((0.02, 0.0), (0.2, 0.0), (1.0, 0.0), (1.0, 90.0))
]
SAMPLES = 400_000
BIN_M, BIN_RAD = 0.05, math.radians(10)
SEEDS, FIRST_SEED = 30, 6000
CLAIM = {
    "banana: 5000 particles": ("particle", {"particle.count": 5000.0}),
    "Gaussian: foveal": ("foveal", {}),
    "inflated: foveal": ("foveal", {"foveal.inflate": 1.0}),
}
WORLDS = {
    "anchor": scenes.recipe("anchor"),
    "low noise": replace(scenes.recipe("anchor"), world=World(odometry=0.02, accuracy=0.99, miss=0.0, ghost=0.0)),
}


def compose(pose, step) -> np.ndarray:
    """Poses (..., 3) after steps (..., 3) in their own frames."""
    pose, step = np.asarray(pose, float), np.asarray(step, float)
    c, s = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    x, y = c * step[..., 0] - s * step[..., 1], s * step[..., 0] + c * step[..., 1]
    return np.stack([pose[..., 0] + x, pose[..., 1] + y, pose[..., 2] + step[..., 2]], axis=-1)


def fovea(pose) -> np.ndarray:
    """(11, 11, 11, 3) poses about a mode: by heading, forward, left."""
    steps = np.arange(CELLS) - CELLS // 2
    turn, ahead, left = np.meshgrid(steps * SPACING_RAD, steps * SPACING_M, steps * SPACING_M, indexing="ij")
    return compose(np.broadcast_to(pose, (*turn.shape, 3)), np.stack([ahead, left, turn], axis=-1))


def likelihood_at(made: scenes.Made, row: int, mode) -> np.ndarray:
    """(11, 11, 11) likelihood of one row about a mode, the best 1. Every reading counts in full."""
    settings = {"texture.spacing_m": 0.0, "radial.spacing_m": 0.0}
    weigher = Weigher(made.scene, settings, SPACING_M / math.sqrt(12.0))
    for k in range(row + 1):
        weigher.take(made.observations, k)
    points = fovea(mode)
    loglik = weigher.weigh(points.reshape(-1, 3)).reshape(points.shape[:3])
    return np.exp(loglik - loglik.max())


# ---------------------------------------------------------------------------------------------------------------------
# Fig. 6a, b


def jumps(cube: np.ndarray) -> float:
    """Share of neighbouring points in a slice whose likelihoods differ by more than a factor of two."""
    with np.errstate(divide="ignore", invalid="ignore"):
        log = np.log(np.maximum(cube, 1e-12))
    steps = [np.abs(np.diff(log, axis=axis)).ravel() for axis in (1, 2)]
    return float(np.mean(np.concatenate(steps) > math.log(2.0)))


def fig6a(made: scenes.Made) -> dict:
    """Likelihoods at six rows evenly spread over an exploration, about the true pose."""
    rows = np.linspace(0, len(made.observations), 7).astype(int)[:-1] + 50
    poses = made.observations.truth[rows]
    cubes = np.array([likelihood_at(made, int(k), pose) for k, pose in zip(rows, poses, strict=True)])
    return {"rows": rows, "poses": poses, "cubes": cubes, "jumps": [jumps(cube) for cube in cubes]}


def prior_cube() -> np.ndarray:
    """A Gaussian about the fovea's middle, in its frame."""
    steps = np.arange(CELLS) - CELLS // 2
    turn, ahead, left = np.meshgrid(steps * SPACING_RAD, steps * SPACING_M, steps * SPACING_M, indexing="ij")
    return np.exp(-0.5 * ((ahead / PRIOR_SIGMA[0]) ** 2 + (left / PRIOR_SIGMA[1]) ** 2 + (turn / PRIOR_SIGMA[2]) ** 2))


def peaks(cube: np.ndarray) -> int:
    """Parts that the region above half the mode falls into."""
    high, count = set(zip(*np.nonzero(cube > 0.5 * cube.max()), strict=True)), 0
    while high:
        count, edge = count + 1, [high.pop()]
        while edge:
            k, i, j = edge.pop()
            near = {(k + a, i + b, j + c) for a in (-1, 0, 1) for b in (-1, 0, 1) for c in (-1, 0, 1)} & high
            high -= near
            edge += near
    return count


def fig6b(made: scenes.Made) -> dict:
    """Of 60 rows: the one whose likelihood leaves the least of the prior, and the one whose posterior has most
    parts."""
    candidates, prior = [], prior_cube()
    for row in range(9, len(made.observations), 10):
        truth = made.observations.truth[row]
        mode = compose(truth, PRIOR_OFF)
        cube = likelihood_at(made, row, mode)
        posterior = prior * cube
        share = float(posterior.sum() / prior.sum())
        candidates.append({"row": row, "share": share, "peaks": peaks(posterior), "likelihood": cube})
    chosen = [min(candidates, key=lambda c: c["share"]), max(candidates, key=lambda c: (c["peaks"], -c["share"]))]
    examples = []
    for pick in chosen:
        posterior = prior * pick["likelihood"]
        at = np.array(np.unravel_index(posterior.argmax(), posterior.shape)) - CELLS // 2
        offset = [float(v) for v in (at[1] * SPACING_M, at[2] * SPACING_M, math.degrees(at[0] * SPACING_RAD))]
        examples.append(pick | {"prior": prior, "posterior": posterior / posterior.max(), "mode_moved": offset})
    return {"examples": examples}


# ---------------------------------------------------------------------------------------------------------------------
# Fig. 6c


def border_scene() -> tuple[Scene, Observations]:
    """A robot that drives straight over one border between smooth and rough, believed 0.2 m behind where it is."""
    base = scenes.make("anchor", FIGURE_SEED).scene
    arena = Arena((2.5, 2.5), 0.5, ("VINYL", "ROUGH"), ("VVRRR",) * 5, ())
    tips = tuple(replace(w, tip_m=(CROSS["tip_m"], w.tip_m[1])) for w in base.robot.of_role("texture"))
    robot = replace(base.robot, whiskers=tips)
    start, rows = np.array([CROSS["start_m"], 1.25, 0.0]), CROSS["rows"]
    truth = start + np.outer(np.arange(1, rows + 1), [CROSS["step_m"], 0.0, 0.0])
    behind = (float(start[0] - CROSS["wrong_m"]), 1.25, 0.0)
    scene = Scene(arena, robot, Prior("gaussian", behind, (0.1, 0.05, 0.1)))
    rough = truth[:, 0] + CROSS["tip_m"] > CROSS["border_m"]
    texture = np.zeros((rows, 2, 2))
    texture[~rough, :, 1] = texture[rough, :, 0] = -60.0
    t_s = ROW_S * np.arange(1, rows + 1)
    odometry = np.tile([CROSS["step_m"], 0.0, 0.0], (rows, 1))
    return scene, Observations(t_s, [], odometry, texture, np.zeros((rows, 0)), truth)


def fig6c() -> dict:
    """Error row by row of several filters on that crossing."""
    scene, rows = border_scene()
    runs = {title: localise.run(*spec[:1], scene, rows, spec[1]) for title, spec in FILTERS_6C.items()}
    ahead = {title: (run.poses - rows.truth)[:, 0] for title, run in runs.items()}
    crossed = int(np.argmax(rows.texture[:, 0, 1] == 0.0))
    return {
        "crossed_row": crossed,
        "truth_x_m": rows.truth[:, 0],
        "ahead_m": ahead,
        "poses": {title: run.poses for title, run in runs.items()},
        "covariance": {title: run.table["covariance"] for title, run in runs.items()},
        "summary": {
            title: {
                "error_before_m": float(abs(off[crossed - 1])),
                "error_after_m": float(abs(off[-1])),
                "rows_late": int(np.argmax(np.abs(off) <= DIAMETER_M / 2)) - crossed,
            }
            for title, off in ahead.items()
        },
    }


# ---------------------------------------------------------------------------------------------------------------------
# the banana


def silent_rows(scene: Scene, way: float, turn: float) -> Observations:
    """A turn on the spot, then straight on in steps of 2 cm, nothing read."""
    steps = [[0.0, 0.0, math.radians(turn) / 5]] * (5 if turn else 0) + [[0.02, 0.0, 0.0]] * round(way / 0.02)
    tips, rays = scene.robot.of_role("texture"), scene.robot.of_role("object")
    texture = np.full((len(steps), len(tips), len(scene.arena.textures)), np.nan)
    t_s = ROW_S * np.arange(1, len(steps) + 1)
    return Observations(t_s, [], np.array(steps), texture, np.full((len(steps), len(rays)), np.nan), None)


def sampled(scene: Scene, rows: Observations, seed: int) -> np.ndarray:
    """(n, 3) poses of the exact transition: particles that nothing is read to."""
    made = Filter("particle", scene, {"particle.count": SAMPLES, "particle.recovery": 0.0}, seed)
    made.replay(rows, 0, len(rows))
    return made.components()["pose"]


def binned(poses: np.ndarray, mean: np.ndarray) -> dict[tuple, float]:
    off = poses - mean
    off[:, 2] = np.remainder(off[:, 2] + math.pi, 2 * math.pi) - math.pi
    index, count = np.unique(np.floor(off / (BIN_M, BIN_M, BIN_RAD)).astype(int), axis=0, return_counts=True)
    return {tuple(i): c / len(poses) for i, c in zip(index.tolist(), count.tolist(), strict=True)}


def variation(p: dict, q: dict) -> float:
    return 0.5 * sum(abs(p.get(i, 0.0) - q.get(i, 0.0)) for i in p.keys() | q.keys())


def divergence(p: dict, q: dict) -> float:
    """Kullback-Leibler divergence of p from q in nats; a bin that q has no sample in counts half a sample."""
    return sum(mass * math.log(mass / q.get(i, 0.5 / SAMPLES)) for i, mass in p.items())


def compare_motion(way: float, turn: float, start_deg: float) -> dict:
    """Banana against its Gaussian and against the fovea's size, after one motion."""
    base = scenes.make("anchor", FIGURE_SEED).scene
    arena = Arena((9.0, 9.0), 0.5, base.arena.textures, ("V" * 18,) * 18, ())
    scene = Scene(arena, base.robot, Prior("gaussian", (4.5, 4.5, 0.0), (0.02, 0.02, math.radians(start_deg))))
    rows = silent_rows(scene, way, turn)
    gaussian = localise.run("odometry", scene, rows).table[-1]
    mean, covariance = gaussian["pose"], gaussian["covariance"]
    steps = (CELLS**2 - 1) / 12
    inflated = np.diag([steps * SPACING_M**2] * 2 + [steps * SPACING_RAD**2])
    rng = np.random.default_rng(1)
    banana, again = (binned(sampled(scene, rows, seed), mean) for seed in (1, 2))
    normal = {
        name: binned(mean + rng.multivariate_normal(np.zeros(3), c, SAMPLES), mean)
        for name, c in (("gaussian", covariance), ("inflated", inflated))
    }
    return {
        "way_m": way,
        "turn_deg": turn,
        "start_deg": start_deg,
        "repeat": variation(banana, again),
        **{f"{name}_variation": variation(banana, belief) for name, belief in normal.items()},
        **{f"{name}_nats": divergence(banana, belief) for name, belief in normal.items()},
    }


def end_to_end(world: str, seed: int) -> dict:
    """Error of each way to carry the belief on, on one scene."""
    made = make_recipe(WORLDS[world], FIRST_SEED + seed)
    out = {}
    for title, (name, settings) in CLAIM.items():
        poses = localise.run(name, made.scene, made.observations, settings, seed).poses
        distance = position_errors(poses, made.observations.truth)
        out[title] = {"error_median_m": float(np.median(distance)), "lost": lock_row(distance) is None}
    return out


def claims() -> dict:
    motions = [
        store.once(CACHE / f"motion_{way}_{turn}_{start}.json", lambda m=(way, turn, start): compare_motion(*m))
        for way, turn, start in tqdm(MOTIONS, desc="nav_paper: motions")
    ]
    jobs = [(world, seed) for world in WORLDS for seed in range(SEEDS)]
    runs = {world: [] for world in WORLDS}
    for world, seed in tqdm(jobs, desc="nav_paper: end to end"):
        path = CACHE / f"{world}_{seed}.json".replace(" ", "-")
        runs[world].append(store.once(path, lambda w=world, s=seed: end_to_end(w, s)))
    return {"motions": motions, "end_to_end": {world: total(part) for world, part in runs.items()}, "seeds": SEEDS}


def total(runs: list[dict]) -> dict:
    out = {}
    for title in CLAIM:
        errors = np.array([run[title]["error_median_m"] for run in runs])
        quartiles = np.quantile(errors, (0.25, 0.5, 0.75)).tolist()
        lost = float(np.mean([run[title]["lost"] for run in runs]))
        out[title] = {"error_quartiles_m": quartiles, "lost_share": lost}
    return out


def run(_build: Path) -> None:
    made = scenes.make("anchor", FIGURE_SEED)
    a, b, c, claim = fig6a(made), fig6b(made), fig6c(), claims()
    drawn = {
        "nav_fig6a": lambda: charts.likelihoods(made.scene.arena, a),
        "nav_fig6b": lambda: charts.fusion(b),
        "nav_fig6c": lambda: charts.crossing(c, CROSS),
        "nav_banana": lambda: charts.banana(claim),
    }
    for name, draw in drawn.items():
        store.write_chart(name, draw(), letters=True)
    examples = [{key: e[key] for key in ("row", "share", "peaks", "mode_moved")} for e in b["examples"]]
    result = {
        "fig6a": {"rows": a["rows"].tolist(), "jumps": a["jumps"]},
        "fig6b": examples,
        "fig6c": {"crossed_row": c["crossed_row"], "filters": c["summary"]},
        "banana": claim,
    }
    store.write_result("nav_paper", result)
