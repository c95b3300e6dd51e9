"""The pilot's models, as training and calibration left them in a folder."""

from pathlib import Path

from ..bridge.nodes import check_node, read_nodes
from ..scene import Robot
from ..touch.radial.model import load as load_radial
from ..touch.texture.model import load


def load_models(folder: Path, robot: Robot) -> tuple[dict, dict]:
    """Texture and radial models by whisker name: texture.json, and <whisker>.json of every object whisker.

    surface.json, if it is there, is the texture model of the faces that object whiskers sweep along.
    """
    texture = load(folder / "texture.json")
    surface = load(folder / "surface.json") if (folder / "surface.json").exists() else None
    radial = {w.name: load_radial(folder / f"{w.name}.json") for w in robot.of_role("object")}
    models = {"texture": texture, "object": surface}
    return {w.name: models[w.role] for w in robot.whiskers if models[w.role] is not None}, radial


def check_nodes(path: str, robot: Robot, radial: dict) -> None:
    """NodeError when a radial model is of another node than the list names on its whisker's lane."""
    nodes = read_nodes(path)
    for lane, whisker in enumerate(robot.whiskers):
        if whisker.name in radial:
            check_node(radial[whisker.name].node, nodes.get(lane), whisker.name)
