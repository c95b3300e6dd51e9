"""What the pilot says of the faces that its object whiskers sweep along."""

from dataclasses import replace

import numpy as np
import pytest

from whisker.demo.level1 import explore
from whisker.demo.training import train_surfaces
from whisker.nav import localise
from whisker.pilot.pilot import Pilot
from whisker.robot.models import load_models
from whisker.simulation.scenes import TEXTURES, make_scene
from whisker.touch.radial.model import RadialModel
from whisker.touch.texture.model import TextureModel

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
    TextureModel(list(TEXTURES), [32768.0] * 2, [-99.0] * 2, [99.0] * 2).save(folder / "texture.json")  # all alike
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


def test_cells_are_empty_without_a_contact_and_filters_pass_them_by(models):
    rows, whiskers = flown(models, "ROUGH", TRAINED)
    free = [row for row in rows if all(row[f"{w}_mm"] is None for w in whiskers)]
    assert free and all(c is None for row in free for w in whiskers for c in cells(row, w))
    scene, _ = make_scene(FLOWN)
    plain = [{k: v for k, v in row.items() if "_surface_" not in k} for row in rows]
    with_cells, without = localise.Filter("ekf", scene), localise.Filter("ekf", scene)
    floor = {f"{w.name}_{t}": None for w in scene.robot.of_role("texture") for t in scene.arena.textures}
    for row, bare in zip(rows, plain, strict=True):
        assert with_cells.step(floor | row).pose == without.step(floor | bare).pose


def test_a_robot_without_a_model_of_faces_has_no_such_cells(models, tmp_path):
    for file in models.glob("*.json"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "surface.json").unlink()
    scene, start = walled(FLOWN, "ROUGH")
    pilot = Pilot(scene.robot, *load_models(tmp_path, scene.robot), FLOWN)
    rows, _ = explore(scene, start, pilot, FLOWN, 400)
    assert not any("_surface_" in name for name in rows[0])
