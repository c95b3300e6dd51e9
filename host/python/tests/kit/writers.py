"""Every writer of the command line, ended or failed at each of its file operations; run as a program by test_outputs.

python writers.py FOLDER [WRITER...]; with injector.so before the C library. Prints how many operations each writer has, and
for each way to end whatever it left that is neither the old output nor the new one.
"""

import contextlib
import errno
import io
import json
import os
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import injector
import level0
import numpy as np
from folders import write_observations
from PIL import Image
from rings import make_frames, ring_name
from whisks import write_whisks

from crunchbot import outputs, scene
from crunchbot.bridge.ring import Writer
from crunchbot.cli import main
from crunchbot.nav.localise import ESTIMATE_HEADER
from crunchbot.recording import RecordingError, read
from crunchbot.recording.writing import RecordingWriter
from crunchbot.robot import checkpoint
from crunchbot.robot.navigator import write_report

WAYS = {"killed": 0, "no room": errno.ENOSPC, "broken": errno.EIO, "no descriptor": errno.EMFILE}
RING = ring_name()


@dataclass
class Case:
    """words: of the command, all but the output, which is `out` below the folder; or `call`, with the place. old: makes what
    stands there before. seen: what counts of an output; None: it is not whole."""

    option: str  # of the parser: "command --option"
    out: str
    words: list
    old: Callable[[Path], object]
    call: Callable[[Path], object] | None = None
    seen: Callable[[Path], object] = lambda place: contents(place)

    def run(self, place: Path) -> int:
        if self.call:
            return self.call(place) or 0
        option = self.option.split()[-1]
        words = [*self.words, *([option] if option.startswith("--") else []), place, "--overwrite"]
        return main([str(word) for word in words])


def contents(place: Path) -> object:
    """All bytes below a place; None: there is nothing."""
    if place.is_dir():
        return {str(path.relative_to(place)): path.read_bytes() for path in sorted(place.rglob("*")) if path.is_file()}
    return place.read_bytes() if place.exists() else None


def frames_in(place: Path) -> object:
    """The number of frames of a recording that has its end; the bytes of what is none."""
    try:
        with read(place) as recording:
            return None if recording.damage else sum(map(len, recording.blocks()))
    except RecordingError:
        return contents(place)


def grown(place: Path) -> object:
    """Whole lines; what a run that failed leaves of its own stands beside."""
    data = contents(place)
    return data if data is None or data.endswith(b"\n") else None


def file(place: Path) -> None:
    place.write_bytes(b"what a person made\n")


def cases(folder: Path) -> list[Case]:
    made = level0.record(3, rows=40)
    scene.write(folder / "s", made[0])
    write_observations(folder / "s" / "observations.csv", *made)
    other = level0.record(4, rows=10)

    def old_scene(place: Path) -> None:
        scene.write(place, other[0])
        write_observations(place / "observations.csv", *other)

    Image.fromarray(np.pad(np.full((50, 50), 254, np.uint8), 1)).save(folder / "map.pgm")
    (folder / "map.yaml").write_text(
        "image: map.pgm\nresolution: 0.05\norigin: [-0.05, -0.05, 0]\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    rng = np.random.default_rng(1)
    for name in ("A", "B"):
        (folder / "d" / name).mkdir(parents=True)
        rows = rng.normal(32768, 50 if name == "A" else 500, (1000, 2)).round()
        lines = [f"{n / 2000},{x:.0f},{y:.0f}" for n, (x, y) in enumerate(rows)]
        (folder / "d" / name / "1.csv").write_text("t_s,x,y\n" + "\n".join(lines) + "\n")
    write_whisks(folder / "w.csv", [500.0, 450.0, 400.0, 350.0], [90, 100, 110, 120])
    with RecordingWriter(folder / "r.mcap", {}) as writer:
        writer.block(1, _block())
        writer.finish()
    (folder / "models").mkdir()
    main(
        ["texture", "train", str(folder / "d"), "--method", "naive-bayes", "--out", str(folder / "models/texture.json")]
    )
    for whisker in made[0].robot.of_role("object"):
        main(
            [
                "radial",
                "fit",
                str(folder / "w.csv"),
                "--model",
                "paper",
                "--out",
                str(folder / f"models/{whisker.name}.json"),
            ]
        )

    def old_map(place: Path) -> None:
        shutil.copytree(folder / "oldmap", place)

    shutil.copytree(folder / "s", folder / "half")
    rows = (folder / "half/observations.csv").read_text().splitlines()
    (folder / "half/observations.csv").write_text("\n".join(rows[:20]) + "\n")
    main(["map", str(folder / "half"), "--json", "--out", str(folder / "oldmap")])

    def old_units(place: Path) -> None:
        place.mkdir()
        (place / "whisker-robot.target").write_text("old")

    def old_examples(place: Path) -> None:
        place.mkdir()
        (place / "contacts.csv").write_text("old")

    def estimates(place: Path) -> None:
        with outputs.opened(place, True) as lines:
            for line in (ESTIMATE_HEADER, "0.1,0,0,0,0", "0.2,0,0,0,0"):
                print(line, file=lines, flush=True)

    s, calibrate = folder / "s", ["calibrate", "--ring", RING, "--yes", "--backlog", "--rest-seconds", "0.3"]
    return [
        Case("localise --out", "e.csv", ["localise", s, "--filter", "odometry"], file),
        Case("map --out", "m", ["map", s, "--json"], old_map),
        Case("scene make --out", "f", ["scene", "make", "--family", "anchor", "--steps", 5], old_scene),
        Case("scene map --out", "g", ["scene", "map", s, folder / "map.yaml"], old_scene),
        Case("texture train --out", "t.json", ["texture", "train", folder / "d", "--method", "naive-bayes"], file),
        Case("radial fit --out", "p.json", ["radial", "fit", folder / "w.csv", "--model", "paper"], file),
        Case("export out", "x.csv", ["export", folder / "r.mcap"], file),
        Case("record file", "n.mcap", ["record", "--ring", RING, "--frames", 500], file, seen=frames_in),
        Case("calibrate --out", "c/rest.toml", calibrate, _old_rest, call=lambda place: _calibrate(calibrate, place)),
        Case("examples folder", "ex", ["examples"], old_examples),
        Case("robot --units", "u", ["robot", s, "--models", folder / "models"], old_units),
        Case("navigator --out", "est_grid.csv", [], file, estimates, grown),
        Case("navigator --report", "n.json", [], file, lambda place: write_report(place, {"rows": 3})),
        Case("navigator --checkpoint", "n.checkpoint", [], file, _checkpoint),
    ]


def _old_rest(place: Path) -> None:
    place.parent.mkdir()
    file(place)


def _calibrate(words: list, place: Path) -> int:
    return main([str(word) for word in [*words, "--out", place.parent, "--overwrite"]])


def _checkpoint(place: Path) -> None:
    checkpoint.save(place, checkpoint.Checkpoint("", 1, 1, np.zeros(3), 1, 1, {}))


def _block() -> np.ndarray:
    from crunchbot.recording.messages import encode_block

    return encode_block(make_frames(40))


def child(work: Callable[[], int]) -> tuple[int, int]:
    """Runs in a process of its own. (exit code, or 99 when something was raised; operations counted)."""
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        code = 99
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), 2)
            with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(outputs.UserError):
                code = 2
                try:
                    code = work()
                except outputs.UserError:
                    raise
                except BaseException:  # noqa: BLE001 - reported as 99
                    code = 99
        count = injector.counted()
        injector.arm(Path("/nowhere"))
        os.write(writing, str(count).encode())
        os._exit(code)
    os.close(writing)
    with open(reading, "rb") as pipe:
        count = int(pipe.read() or b"0")
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), count


def try_all(case: Case, folder: Path) -> dict:
    """The case ended at each operation, or at two hundred of many, and failed at six."""

    def fresh() -> Path:
        shutil.rmtree(folder / "try", ignore_errors=True)
        (folder / "try").mkdir()
        case.old(folder / "try" / case.out)
        return folder / "try" / case.out

    old, place = case.seen(fresh()), fresh()
    code, operations = child(lambda: (injector.arm(folder / "try"), case.run(place))[1])
    new, lost, ends = case.seen(place), [], 0
    if code or new in (None, old):
        return {"operations": 0, "lost": [f"without a fault: exit code {code}"]}
    for way, error in WAYS.items():
        for at in range(1, operations + 1, 1 + operations // (6 if error else 200)):
            place = fresh()
            code, _ = child(
                lambda at=at, error=error, place=place: (injector.arm(folder / "try", at, error), case.run(place))[1]
            )
            if case.seen(place) not in (old, new):
                lost.append(f"{way} at {at} of {operations}: exit code {code}, neither old nor new")
            if code == 99:
                lost.append(f"{way} at {at} of {operations}: raised")
            ends += 1
    return {"operations": operations, "ends": ends, "lost": lost}


def run() -> int:
    folder, wanted = Path(sys.argv[1]), sys.argv[2:]
    with contextlib.redirect_stdout(io.StringIO()):
        found = cases(folder)
    with Writer(RING, 4096) as ring:
        ring.publish(make_frames(2000))
        for case in found:
            if not wanted or case.option in wanted:
                print(json.dumps({"option": case.option, "out": case.out} | try_all(case, folder)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(run())
