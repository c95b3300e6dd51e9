"""Models of a demo robot from next to no training: of the right kind, for runs that nobody judges by them."""

from pathlib import Path

from crunchbot.touch.radial.model import RadialModel
from crunchbot.touch.texture.model import read_training
from crunchbot_lab.demo.training import MOVES, fit_texture, flat
from crunchbot_lab.signals.recordings import write_surface_drives
from crunchbot_lab.simulation.scenes import make_scene

LINE = (-0.036, 181.0, 5.0, 90.0, 140.0)  # of a radial model


def quick_models(folder: Path, seed: int) -> Path:
    """Writes texture.json and <whisker>.json into the folder; returns it."""
    scene, _ = make_scene(seed)
    write_surface_drives(folder / "texture", flat(scene), scene.arena.textures, seed, 2.0, speeds=[0.15], moves=MOVES)
    found, _ = read_training(folder / "texture")
    fit_texture({name: found[name] for name in scene.arena.textures}, seed).save(folder / "texture.json")
    for whisker in scene.robot.of_role("object"):
        RadialModel(*LINE).save(folder / f"{whisker.name}.json")
    return folder
