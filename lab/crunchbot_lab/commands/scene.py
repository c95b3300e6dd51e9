"""`whisker scene`: draws level-0 scenes of a family, or makes one of a recording (crunchbot_lab.scenes)."""

import argparse

from crunchbot.arguments import add_action, add_output, add_topics, warn, whole_number
from crunchbot.nav.filters import SettingError
from crunchbot.nav.observations import observations_path, read_observations
from crunchbot.outputs import made
from crunchbot.scene import HELD, OBSTACLES_MOST, SceneError, load, write

from .. import scenes

EXAMPLE = "whisker scene make --family anchor+kidnap --seed 7 --out scenes/7"


def add(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    p = add_action(actions, "make", "draw a scene of a family, observations and truth included", EXAMPLE, make)
    p.add_argument("--family", metavar="F", help="joined by '+': see --list-families").values = list(scenes.BASES)
    p.add_argument("--seed", type=whole_number(0), default=0, metavar="N", help="draws arena, path and noise")
    p.add_argument("--steps", type=whole_number(1), metavar="N", help="rows of 0.1 s (default: the family's)")
    add_output(p, "--out", own=HELD, metavar="DIR", help="folder to write")
    p.add_argument("--list-families", action="store_true", help="print bases and modifiers and leave")
    example = "whisker scene from robot-run/robot.mcap --out scenes/run"
    p = add_action(actions, "from", "make a scene of a run's recording", example, from_recording)
    p.add_argument(
        "kind",
        nargs="?",
        default="",
        help=f"of the recording: {', '.join(scenes.READERS)} (default: found from its files)",
    )
    text = (
        "folder that a run left, as build/demo; a robot's bag, or one that 'ros2 bag record' made; a Thymio's recording"
    )
    p.add_argument("recording", help=text)
    p.add_argument("--scene", metavar="SCENE", help="arena, robot and prior of a bag: those that it lacks, or others")
    add_topics(p)
    add_output(p, "--out", own=HELD, required=True, metavar="DIR", help="folder to write")
    example = "whisker scene map examples/scene examples/home.yaml --out scenes/mapped"
    text = "put an occupancy map into a scene folder, for all commands that take one"
    p = add_action(actions, "map", text, example, with_map)
    p.add_argument("scene", help="scene folder; without arena.toml the map is the arena, and its origin the arena's")
    p.add_argument("map", metavar="MAP.YAML", help="a ROS map server's YAML file")
    add_output(p, "--out", own=HELD, required=True, metavar="DIR", help="folder to write")


def make(arguments: argparse.Namespace) -> int:
    if arguments.list_families:
        print("\n".join(f"{name}: {recipe.text}" for name, recipe in scenes.BASES.items()))
        print("\n".join(f"+{name}: {text}" for name, (text, _) in scenes.MODIFIERS.items()))
        return 0
    if arguments.family is None or arguments.out is None:
        raise SettingError("scene make: needs --family and --out; see --list-families")
    drawn = scenes.make(arguments.family, arguments.seed, arguments.steps)
    _write(arguments, drawn.scene, drawn.observations)
    print(f"{arguments.out}: {arguments.family}, seed {arguments.seed}, {len(drawn.observations.t_s)} rows")
    return 0


def from_recording(arguments: argparse.Namespace) -> int:
    if arguments.kind not in ("", *scenes.READERS):
        raise SettingError(f"scene from: kind '{arguments.kind}' is unknown; choose one of {', '.join(scenes.READERS)}")
    given = (arguments.scene, arguments.topics)
    scene, observations = scenes.read_recording(arguments.recording, warn, arguments.kind, *given)
    _write(arguments, scene, observations)
    print(f"{arguments.out}: from {arguments.recording}, {len(observations)} rows")
    return 0


def with_map(arguments: argparse.Namespace) -> int:
    scene = load(arguments.scene, arguments.map)
    boxes = max(len(scene.arena.obstacles), len(scene.arena.unknown))
    if boxes > OBSTACLES_MOST:
        raise SceneError(
            f"{arguments.map}: {boxes} boxes, {OBSTACLES_MOST} are the most of a folder; make the image coarser"
        )
    path = observations_path(arguments.scene)
    observations = read_observations(path, scene) if path.exists() else None
    _write(arguments, scene, None if observations is None else scenes.rounded(observations))
    print(f"{arguments.out}: {arguments.scene} with {arguments.map}, {boxes} boxes")
    return 0


def _write(arguments: argparse.Namespace, scene, observations) -> None:
    with made(arguments.out, arguments.overwrite, HELD) as folder:
        if observations is None:
            write(folder, scene)
        else:
            scenes.write_scene(folder, scene, observations)
