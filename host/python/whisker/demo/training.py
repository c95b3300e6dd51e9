"""Texture training and radial calibration: recorded at level 1 in the contract's formats, learnt from the files."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..behaviour import EXPLORE_M_S, PUSH_TICKS, TICK_S, TURN_RAD_S
from ..contact import REST_SAMPLES, Contact
from ..floor import centred
from ..radial import RadialModel, peak, read_whisks
from ..scene import Scene
from ..texture import TextureModel, read_folder
from .simulation import radial_contacts, surface_drive, write_radial_contacts

# Drives at different times: each has its own drift of the sensor's rest, and its own roughness.
DRIVES = 8
DRIVE_S = 8.0
# What exploring consists of: share of the speed, turn (rad/s), seconds.
MOVES = ((1.0, 0.0, 3.0), (0.0, TURN_RAD_S, 1.5), (1.0, 0.0, 1.5), (0.0, -TURN_RAD_S, 1.5), (-1.0, 0.0, 0.5))

FIT_CONTACTS = 5  # at each radius: the paper's calibration
HELD_OUT_CONTACTS = 40
RECORDED_PUSH_S = 0.7  # longer than the pilot's, which counts from the onset that it notices
# Whisk repeatability of whiskers 1 to 4, and the error it alone predicts over 90 to 140 mm (whisker_physics section 4).
WHISK_SPREAD = (0.082, 0.040, 0.026, 0.063)
PREDICTED_MM_PER_SPREAD = 68.9


def learn(folder: Path, scene: Scene, seed: int, progress: Callable[[], object]) -> tuple[dict, dict]:
    """All models of the scene's robot, saved in `folder`; `progress()` after each.

    Returns radial models by whisker name, and their contacts as `calibrate` does.
    """
    folder.mkdir(parents=True, exist_ok=True)
    train_texture(folder, scene, seed)
    progress()
    models, contacts = {}, {}
    for whisker in scene.robot.of_role("object"):
        models[whisker.name], contacts[whisker.name] = calibrate(folder, scene, whisker.name, seed)
        progress()
    return models, contacts


def train_texture(folder: Path, scene: Scene, seed: int) -> TextureModel:
    """Drive over each single surface, record, and learn one model for both floor whiskers from the files."""
    recordings = folder / "texture"
    for number, texture in enumerate(scene.arena.textures):
        place = recordings / texture
        place.mkdir(parents=True, exist_ok=True)
        for drive in range(DRIVES):
            drive_seed = _derive(seed, number, drive)
            driven = surface_drive(flat(scene), texture, EXPLORE_M_S, DRIVE_S, drive_seed, MOVES)
            for whisker, counts in driven.items():
                _write_recording(place / f"{whisker}_{drive + 1}.csv", counts)
    found = read_folder(recordings)
    model = fit_texture({name: found[name] for name in scene.arena.textures}, seed)
    model.save(folder / "texture.json")
    return model


def fit_texture(recordings: dict[str, list[np.ndarray]], seed: int) -> TextureModel:
    """A model of deflections about each recording's own mean, as the pilot uses it; its rest is the middle of all means."""
    rng = np.random.default_rng(seed)
    middle = np.mean([r.mean(axis=0) for group in recordings.values() for r in group], axis=0)
    return TextureModel.train(
        {name: [centred(r, middle, rng) for r in g] for name, g in recordings.items()}, rest=middle
    )


def _write_recording(path: Path, counts: np.ndarray) -> None:
    rows = (f"{n * TICK_S:.4f},{x},{y}\n" for n, (x, y) in enumerate(counts.tolist()))
    path.write_text("t_s,x,y\n" + "".join(rows))


def _derive(seed: int, *path: int) -> int:
    """A seed of its own for each recording."""
    return int(np.random.SeedSequence([seed, *path]).generate_state(1, np.uint64)[0])


def calibrate(folder: Path, scene: Scene, name: str, seed: int) -> tuple[RadialModel, dict]:
    """Whisk one whisker against a corner at known distances: the model, and its contacts, fitted and held out.

    Contacts: {"fit", "held out"} -> (radius mm (n,), peak counts (n,)).
    """
    path = folder / "radial" / f"{name}.csv"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_radial_contacts(path, _contacts(scene, name, 2 * seed, FIT_CONTACTS))
    fit = read_whisks(path, with_radius=True)
    model = RadialModel.fit(fit.peak_counts, fit.radius_mm)
    model.save(folder / f"{name}.json")
    tests = _contacts(scene, name, 2 * seed + 1, HELD_OUT_CONTACTS)
    radii = np.array([contact.radius_mm for contact in tests])
    peaks = np.array([peak(c.counts, np.median(c.counts[: REST_SAMPLES // 4], axis=0)) for c in tests])
    return model, {"fit": (fit.radius_mm, fit.peak_counts), "held out": (radii, peaks)}


def radial_scores(models: dict[str, RadialModel], contacts: dict[str, dict]) -> dict:
    """Standard deviation of the held-out error, mm, by whisker, and what repeatability alone predicts."""
    measured = {}
    for name, sets in contacts.items():
        error = [models[name].predict(p)[0] - r for r, p in zip(*sets["held out"], strict=True)]
        measured[name] = float(np.std(error, ddof=1))
    predicted = {n: PREDICTED_MM_PER_SPREAD * s for n, s in zip(contacts, WHISK_SPREAD, strict=True)}
    return {"radial_std_mm": measured, "radial_std_predicted_mm": predicted}


def write_radial_points(folder: Path, models: dict[str, RadialModel], contacts: dict[str, dict]) -> None:
    """radial_points.csv and radial_lines.json, for the report."""
    with open(folder / "radial_points.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("whisker", "set", "radius_mm", "peak_counts", "predicted_mm"))
        for name, sets in contacts.items():
            for kind, points in sets.items():
                writer.writerows(
                    (name, kind, f"{r:g}", f"{p:.2f}", f"{models[name].predict(p)[0]:.3f}")
                    for r, p in zip(*points, strict=True)
                )
    lines = {name: [model.a1, model.a0] for name, model in models.items()}
    (folder / "radial_lines.json").write_text(json.dumps(lines, indent=1) + "\n")


def flat(scene: Scene) -> str:
    """The scene's robot for the recording benches, which bring their own arena and start."""
    return scene.flat((0.0, 0.0, 0.0))


def _contacts(scene: Scene, name: str, seed: int, repeats: int) -> list:
    """Whisks cut where the pilot's push ends: 0.6 s after the onset that it would notice, so that peaks compare."""
    contacts = radial_contacts(flat(scene), name, seed, repeats, RECORDED_PUSH_S)
    return [contact._replace(counts=contact.counts[: _onset(contact.counts) + PUSH_TICKS]) for contact in contacts]


def _onset(counts: np.ndarray) -> int:
    contact = Contact()
    contact.block(np.arange(len(counts)), counts.astype(float), np.ones(len(counts), bool))
    return contact.onset
