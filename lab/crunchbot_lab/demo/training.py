"""Texture training and radial calibration: recorded at level 1 in files (docs/formats.md), learnt from them."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from crunchbot.outputs import opened, put
from crunchbot.pilot.behaviour import EXPLORE_M_S, PUSH_TICKS, TURN_RAD_S
from crunchbot.scene import Scene
from crunchbot.touch.contact import REST_SAMPLES, Contact
from crunchbot.touch.floor import centred
from crunchbot.touch.radial.model import RadialModel, fit, peak, read_whisks, save
from crunchbot.touch.texture.model import TextureModel, read_training
from crunchbot.touch.texture.spectral import SpectralModel
from crunchbot.touch.texture.train import train

from ..signals import World
from ..signals.recordings import radial_contacts, write_radial_contacts, write_surface_drives, write_surface_sweeps

# Each drive is at another time and place: it has its own drift of the sensor's rest, its own roughness, and its own height
# of the floor, which sets the pace at which a tip slips. Few heights leave the others for floors never trained.
DRIVES = 20
DRIVE_S = 4.8
# What exploring consists of: share of the speed, turn (rad/s), seconds.
MOVES = ((1.0, 0.0, 1.6), (0.0, TURN_RAD_S, 1.0), (1.0, 0.0, 0.8), (0.0, -TURN_RAD_S, 1.0), (-1.0, 0.0, 0.4))

CONTACTS = "contacts.json"  # beside the models
METHODS = ("spectral", "paper")  # of texture; the first is the default

FIT_CONTACTS = 5  # at each radius: the paper's calibration
HELD_OUT_CONTACTS = 40
RECORDED_PUSH_S = 0.7  # longer than the pilot's, which counts from the onset that it notices
PREDICTED_MM_PER_SPREAD = 68.9  # error over 90 to 140 mm from whisk repeatability alone (whisker_physics section 4)


def learn(
    folder: Path, scene: Scene, seed: int, progress: Callable[[], object], method: str = METHODS[0]
) -> tuple[dict, dict]:
    """All models of the scene's robot, saved in `folder`; `progress()` after each. `method`: texture's, of METHODS.

    Returns the paper's lines and the contacts, as `calibrations` reads them.
    """
    folder.mkdir(parents=True, exist_ok=True)
    train_texture(folder, scene, seed, method)
    if scene.arena.wall or scene.arena.surfaces:
        train_surfaces(folder, scene, seed)
    progress()
    contacts = {}
    for whisker in scene.robot.of_role("object"):
        contacts[whisker.name] = calibrate(folder, scene, whisker.name, seed)
        progress()
    lists = {name: {key: [part.tolist() for part in pair] for key, pair in of.items()} for name, of in contacts.items()}
    put(folder / CONTACTS, json.dumps(lists) + "\n")
    return calibrations(folder)


def calibrations(folder: Path) -> tuple[dict[str, RadialModel], dict[str, dict]]:
    """What `learn` has left for the report: the paper's lines by whisker name, and the contacts of `calibrate`."""
    lists = json.loads((folder / CONTACTS).read_text())
    contacts = {name: {key: tuple(map(np.array, pair)) for key, pair in of.items()} for name, of in lists.items()}
    lines = {
        name: RadialModel.fit(peaks, radii) for name, (radii, peaks) in ((n, c["fit"]) for n, c in contacts.items())
    }
    return lines, contacts


def train_texture(folder: Path, scene: Scene, seed: int, method: str = METHODS[0]) -> TextureModel | SpectralModel:
    """Drive over each single surface, record, and learn one model for both floor whiskers from the files."""
    recordings = folder / "texture"
    write_surface_drives(
        recordings, flat(scene), scene.arena.textures, seed, DRIVE_S, speeds=[EXPLORE_M_S] * DRIVES, moves=MOVES
    )
    found, rate_hz = read_training(recordings)
    known = {name: found[name] for name in scene.arena.textures}
    model = fit_texture(known, seed) if method == "paper" else train(known, rate_hz)
    model.save(folder / "texture.json")
    return model


def train_surfaces(folder: Path, scene: Scene, seed: int) -> SpectralModel:
    """Sweep along walls of each texture that the scene has, record, and learn one model for all object whiskers."""
    arena, recordings = scene.arena, folder / "surface"
    names = dict.fromkeys([*arena.textures, *filter(None, [arena.wall]), *dict(arena.surfaces).values()])
    write_surface_sweeps(recordings, flat(scene), names, seed)
    found, rate_hz = read_training(recordings)
    model = train({name: found[name] for name in names}, rate_hz)
    model.save(folder / "surface.json")
    return model


def fit_texture(recordings: dict[str, list[np.ndarray]], seed: int) -> TextureModel:
    """A model of deflections about each recording's own mean, as the pilot uses it; its rest is the middle of all means."""
    rng = np.random.default_rng(seed)
    middle = np.mean([r.mean(axis=0) for group in recordings.values() for r in group], axis=0)
    return TextureModel.train(
        {name: [centred(r, middle, rng) for r in g] for name, g in recordings.items()}, rest=middle
    )


def calibrate(folder: Path, scene: Scene, name: str, seed: int) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Whisk one whisker against a corner at known distances: its line, and its plug for the pilot, into the folder.

    Returns the contacts: {"fit", "held out"} -> (radius mm (n,), peak counts (n,)).
    """
    path = folder / "radial" / f"{name}.csv"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_radial_contacts(path, _contacts(scene, name, 2 * seed, FIT_CONTACTS))
    whisks = read_whisks(path, with_radius=True)
    save(fit(whisks, "linear").model, folder / f"{name}.json")
    tests = _contacts(scene, name, 2 * seed + 1, HELD_OUT_CONTACTS)
    radii = np.array([contact.radius_mm for contact in tests])
    peaks = np.array([peak(c.counts, np.median(c.counts[: REST_SAMPLES // 4], axis=0)) for c in tests])
    return {"fit": (whisks.radius_mm, whisks.peak_counts), "held out": (radii, peaks)}


def radial_scores(scene: Scene, models: dict[str, RadialModel], contacts: dict[str, dict]) -> dict:
    """Standard deviation of the held-out error, mm, by whisker, and what repeatability alone predicts."""
    measured = {}
    for name, sets in contacts.items():
        error = [models[name].predict(p)[0] - r for r, p in zip(*sets["held out"], strict=True)]
        measured[name] = float(np.std(error, ddof=1))
    world = World(flat(scene), 0)
    predicted = {name: PREDICTED_MM_PER_SPREAD * world.spread(world.lanes.index(name)) for name in contacts}
    return {"radial_std_mm": measured, "radial_std_predicted_mm": predicted}


def write_radial_points(folder: Path, models: dict[str, RadialModel], contacts: dict[str, dict]) -> None:
    """radial_points.csv and radial_lines.json, for the report."""
    with opened(folder / "radial_points.csv", True) as file:
        writer = csv.writer(file)
        writer.writerow(("whisker", "set", "radius_mm", "peak_counts", "predicted_mm"))
        for name, sets in contacts.items():
            for kind, points in sets.items():
                writer.writerows(
                    (name, kind, f"{r:g}", f"{p:.2f}", f"{models[name].predict(p)[0]:.3f}")
                    for r, p in zip(*points, strict=True)
                )
    lines = {name: [model.a1, model.a0] for name, model in models.items()}
    put(folder / "radial_lines.json", json.dumps(lines, indent=1) + "\n")


def flat(scene: Scene) -> str:
    """The scene's robot for the recording benches, which bring their own arena and start.

    ValueError for a scene as a folder holds it: it does not state which whiskers are simulated, and each batch of them
    wants its own models.
    """
    if not scene.simulated:
        raise ValueError("scene: field simulated: empty; take the scene of simulation.bridge.simulated_scene")
    return scene.flat((0.0, 0.0, 0.0))


def _contacts(scene: Scene, name: str, seed: int, repeats: int) -> list:
    """Whisks cut where the pilot's push ends: 0.6 s after the onset that it would notice, so that peaks compare."""
    contacts = radial_contacts(flat(scene), name, seed, repeats, RECORDED_PUSH_S)
    return [contact.until(_onset(contact.counts) + PUSH_TICKS) for contact in contacts]


def _onset(counts: np.ndarray) -> int:
    contact = Contact()
    contact.block(np.arange(len(counts)), counts.astype(float), np.ones(len(counts), bool))
    return contact.onset
