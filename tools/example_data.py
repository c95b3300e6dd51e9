"""Makes the small data set that `whisker examples` unpacks, and the bag that `whisker try` plays: host/python/crunchbot/data.

Everything is simulated: a scene at level 0, a robot's floor and object whiskers at level 1, a recording of the simulated
bridge. The node's image is the committed one.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from collections import Counter
from pathlib import Path

import numpy as np

from crunchbot.recording.mcapfile import McapFile
from crunchbot.recording.writing import TopicWriter
from crunchbot.robot.bags.played import RECORD, SCENE_FILES
from crunchbot.robot.network.messages import SCHEMAS, decode, type_of
from crunchbot.scene import load
from crunchbot_lab.demo.training import flat
from crunchbot_lab.scenes.files import write_scene
from crunchbot_lab.scenes.making import make
from crunchbot_lab.signals.recordings import radial_contacts, write_radial_contacts, write_surface_drives
from crunchbot_lab.simulation.scenes import make_scene as demo_scene

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT / "host/python/crunchbot/data"
ZIP, MINUTE = DATA / "examples.zip", DATA / "first_minute.mcap"
FAMILY, ROWS, SEED = "anchor", 600, 7
MAP_M = 0.05
SPEEDS_M_S, SWEEP_S = (0.1, 0.15, 0.2), 4.0
REPEATS, PUSH_S = 2, 0.4
RECORDED_S = 2
WHISKER = (sys.executable, "-m", "crunchbot.cli")
SHOWN = ("observation", "localisation", "belief", "contact", "behaviour", "truth", "health")
SHOWN_FILTER, BELIEF_EACH = "adaptive", 4
EPOCH = (2026, 1, 1, 0, 0, 0)  # of every entry: the same content is the same file


def make_scene(folder: Path) -> None:
    """A scene to localise in, with the true poses."""
    made = make(FAMILY, SEED, ROWS)
    write_scene(folder, made.scene, made.observations)


def make_map(folder: Path) -> None:
    """A map server's YAML and image of the same arena: free, with a cupboard of 0.4 m by 0.2 m that the scene lacks."""
    wide, high = load(folder / "scene").arena.size_m
    columns, rows = round(wide / MAP_M), round(high / MAP_M)
    grey = np.full((rows, columns), 254, np.uint8)
    grey[rows // 2 : rows // 2 + 4, columns // 3 : columns // 3 + 8] = 0
    (folder / "home.pgm").write_bytes(b"P5 %d %d 255\n" % (columns, rows) + grey.tobytes())
    fields = f"resolution: {MAP_M}\norigin: [0.0, 0.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    (folder / "home.yaml").write_text(f"image: home.pgm\n{fields}")


def make_touch(folder: Path) -> None:
    """Recordings of three floors, a folder each, and of contacts at known distances."""

    scene = demo_scene(SEED)[0]
    drives = folder / "drives"
    write_surface_drives(drives, flat(scene), scene.arena.textures, SEED, SWEEP_S, SPEEDS_M_S)
    whisker = scene.robot.of_role("texture")[0].name
    for path in sorted(drives.glob(f"*/{whisker}_*.csv")):
        place = folder / "surfaces" / path.parent.name / path.name.removeprefix(f"{whisker}_")
        place.parent.mkdir(parents=True, exist_ok=True)
        path.rename(place)
    shutil.rmtree(drives)
    whisker = scene.robot.of_role("object")[0].name
    write_radial_contacts(folder / "contacts.csv", radial_contacts(flat(scene), whisker, SEED, REPEATS, PUSH_S))


def make_models(folder: Path) -> None:
    """What the commands learn from those."""
    fit = ["radial", "fit", "contacts.csv", "--out", "radial.json"]
    for words in (["texture", "train", "surfaces", "--out", "texture.json"], fit):
        subprocess.run([*WHISKER, *words], cwd=folder, check=True)


def make_recording(path: Path) -> None:
    """What the simulated bridge sends while the robot turns."""
    ring = ["--ring", "whisker-example-data"]
    bridge = subprocess.Popen([*WHISKER, "bridge-sim", *ring, "--level", "bytes", "--seed", str(SEED)])
    try:
        time.sleep(1.0)
        subprocess.run(
            [*WHISKER, "record", path, *ring, "--wait", "60", "--seconds", str(RECORDED_S), "--overwrite"], check=True
        )
    finally:
        bridge.terminate()
        bridge.wait()


def make_minute(folder: Path, path: Path) -> None:
    """The bag of the demo with what the page shows of one filter: every row, and a belief every two seconds."""
    build = ["--build-dir", ROOT / "build/release", "--spread", "1"]
    subprocess.run([sys.executable, "-m", "crunchbot_lab.demo", "--out", folder / "demo", *build], cwd=ROOT, check=True)
    path.unlink(missing_ok=True)
    with McapFile(folder / "demo/robot.mcap") as bag, TopicWriter(path, RECORD, told_first(bag)) as writer:
        seen: Counter[str] = Counter()
        for message in bag.messages():
            topic = message.topic.removeprefix("/robot/")
            if topic == message.topic or not shown(topic, bytes(message.data), seen):
                continue
            if seen[topic] == 1:
                writer.topic(message.topic, SCHEMAS[type_of(topic)])
            writer.add(message.topic, message.log_time, bytes(message.data))
        writer.finish()


def told_first(bag: McapFile) -> dict[str, str]:
    """What the bag's record of the robot said at its beginning."""
    return {
        key: value for key, value in bag.metadata[RECORD].items() if key in ("format", "robot", "started", *SCENE_FILES)
    }


def shown(topic: str, data: bytes, seen: Counter[str]) -> bool:
    """Whether the page needs it; counts it."""
    if topic.partition("/")[0] not in SHOWN:
        return False
    if topic in ("localisation", "belief") and decode(type_of(topic), data, topic).filter != SHOWN_FILTER:
        return False
    seen[topic] += 1
    return topic != "belief" or (seen[topic] - 1) % BELIEF_EACH == 0


def pack(folder: Path, path: Path) -> None:
    """All files of a folder in a zip whose bytes follow from theirs."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as packed:
        for file in sorted(file for file in folder.rglob("*") if file.is_file()):
            entry = zipfile.ZipInfo(file.relative_to(folder).as_posix(), EPOCH)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            packed.writestr(entry, file.read_bytes())


def main() -> int:
    argparse.ArgumentParser(description=__doc__.splitlines()[0], epilog="example: tools/example_data.py").parse_args()
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        make_scene(folder / "scene")
        make_map(folder)
        make_touch(folder)
        make_models(folder)
        make_recording(folder / "drive.mcap")
        shutil.copyfile(ROOT / "firmware/images/node.whex", folder / "node.whex")
        pack(folder, ZIP)
        make_minute(folder, MINUTE)
    for path in (ZIP, MINUTE):
        print(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1e3:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
