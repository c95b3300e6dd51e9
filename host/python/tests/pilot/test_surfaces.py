"""What the pilot says of the faces that its object whiskers sweep along."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from crunchbot.nav import localise
from crunchbot.nav.observations import read_observations
from crunchbot.pilot.feel import Felt
from crunchbot.pilot.pilot import Pilot
from crunchbot.robot.models import load_models
from crunchbot.robot.rowfiles import Rows
from crunchbot.touch.radial.model import RadialModel
from crunchbot.touch.texture.model import TextureModel, classify, load
from crunchbot_lab.demo.level1 import explore
from crunchbot_lab.demo.training import flat, read_training, train_surfaces
from crunchbot_lab.signals.recordings import write_surface_sweeps
from crunchbot_lab.simulation.scenes import TEXTURES, make_scene

TRAINED, FLOWN, TICKS = 3, 31, 120_000


def walled(seed: int, texture: str):
    """The scene of a seed with one texture on all walls and boxes, and its start."""
    scene, start = make_scene(seed)
    faces = tuple((box, texture) for box in scene.arena.obstacles)
    return replace(scene, arena=replace(scene.arena, wall=texture, surfaces=faces)), start


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    scene, _ = walled(TRAINED, TEXTURES[0])
    alike = np.full((len(TEXTURES), 2, 2), np.log(0.5))
    TextureModel(list(TEXTURES), [32768.0] * 2, [-99.0] * 2, [99.0] * 2, alike).save(folder / "texture.json")
    line = RadialModel.fit(np.array([200.0, 600.0, 1000.0]), np.array([140.0, 120.0, 90.0]))
    for whisker in scene.robot.of_role("object"):
        line.save(folder / f"{whisker.name}.json")
    train_surfaces(folder, scene, TRAINED)
    return folder


def cells(row: dict, whisker: str) -> list[float | None]:
    return [row[f"{whisker}_surface_{texture}"] for texture in TEXTURES]


def flown(models, texture: str, batch: int) -> tuple[list[dict], list[str]]:
    """Rows of a flight between walls of this texture, with whiskers of that batch, and the object whiskers' names."""
    scene, start = walled(FLOWN, texture)
    scene = replace(scene, simulated=("mechanics static", f"batch {batch}"))
    pilot = Pilot(scene.robot, *load_models(models, scene.robot), FLOWN)
    rows, _ = explore(scene, start, pilot, FLOWN, TICKS)
    return rows, [w.name for w in scene.robot.of_role("object")]


@pytest.mark.parametrize("texture", TEXTURES)
def test_the_texture_of_a_face_is_found_while_the_tip_sweeps_along_it(models, texture):
    rows, whiskers = flown(models, texture, TRAINED)
    read = [np.array(c) for row in rows for w in whiskers if None not in (c := cells(row, w))]
    right = [TEXTURES[int(np.argmax(c))] == texture for c in read]
    assert len(read) >= 10
    assert np.mean(right) > 0.6, f"{sum(right)} of {len(right)}"
    assert TEXTURES[int(np.argmax(np.sum(read, axis=0)))] == texture


def test_whiskers_and_walls_that_were_not_trained(models, tmp_path):
    """Of every texture most windows are right: a model that knows one texture only, or one robot only, fails."""
    scene, _ = make_scene(TRAINED + 1)
    write_surface_sweeps(tmp_path, flat(scene), TEXTURES, seed=FLOWN, count=4)
    recordings, rate_hz = read_training(tmp_path)
    model = load(models / "surface.json")
    for texture in TEXTURES:
        found = [d for r in recordings[texture] for d in classify(model, np.arange(len(r)) / rate_hz, r)]
        right = np.mean([d.best == texture for d in found])
        assert len(found) > 50 and right > 0.6, f"{texture}: {right:.2f} of {len(found)}"


def test_a_tip_that_sticks_and_a_shaft_are_not_judged(models):
    scene, _ = walled(FLOWN, "ROUGH")
    pilot = Pilot(scene.robot, *load_models(models, scene.robot), FLOWN)
    lane = pilot.face_lanes[0]
    pilot.behaviour.drive, pilot.behaviour.drive_since = (0.0, 0.1), 0
    pilot.contacts[lane] = SimpleNamespace(onset=0, touching=True)
    assert pilot._along_face(lane, 2000)
    for face, slip, judged in ((1.0, 1.0, True), (1.0, 0.5, False), (0.5, 1.0, False)):
        pilot.feelers[lane] = SimpleNamespace(felt=Felt(0, (0.2, 0.0), 0.001, face=face, slip=slip))
        assert pilot._along_face(lane, 2000) == judged


def test_cells_are_empty_without_a_contact_and_filters_pass_them_by(models):
    rows, whiskers = flown(models, "ROUGH", TRAINED)
    free = [row for row in rows if all(row[f"{w}_mm"] is None for w in whiskers)]
    assert free and all(c is None for row in free for w in whiskers for c in cells(row, w))
    scene, _ = make_scene(FLOWN)
    plain = [{k: v for k, v in row.items() if "_surface_" not in k} for row in rows]
    with_cells, without = localise.Filter("ekf", scene), localise.Filter("ekf", scene)
    floor = {f"{w.name}_{t}": None for w in scene.robot.of_role("texture") for t in scene.arena.textures}
    for row, bare in zip(rows, plain, strict=True):
        assert with_cells.step({**floor, **row}).pose == without.step(floor | bare).pose


def test_a_file_with_such_cells_reads_as_one_without(models, tmp_path):
    rows, _ = flown(models, "ROUGH", TRAINED)
    scene, _ = walled(FLOWN, "ROUGH")
    floor = {f"{w.name}_{t}": None for w in scene.robot.of_role("texture") for t in scene.arena.textures}
    read = []
    for n, out in enumerate((rows, [{k: v for k, v in row.items() if "_surface_" not in k} for row in rows])):
        with open(tmp_path / f"{n}.csv", "w", newline="") as file:
            written = Rows(file)
            for row in out:
                written.write({**floor, **row})
        read.append(read_observations(tmp_path / f"{n}.csv", scene))
    assert "_surface_ROUGH" in (tmp_path / "0.csv").read_text() and np.isfinite(read[0].radial_m).any()
    assert np.array_equal(read[0].radial_m, read[1].radial_m, equal_nan=True)
    assert np.array_equal(read[0].odometry, read[1].odometry)


def test_a_robot_without_a_model_of_faces_has_no_such_cells(models, tmp_path):
    for file in models.glob("*.json"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "surface.json").unlink()
    scene, start = walled(FLOWN, "ROUGH")
    pilot = Pilot(scene.robot, *load_models(tmp_path, scene.robot), FLOWN)
    rows, _ = explore(scene, start, pilot, FLOWN, 400)
    assert not any("_surface_" in name for name in rows[0])
