"""`whisker texture`: learns surfaces from recordings and classifies them (crunchbot.touch.texture)."""

import argparse
import json
import re
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from whisker_protocol import LANES, LIMITS

from ..arguments import add_action, add_output, add_ring, lane_list, number_above, plain, warn
from ..bridge.ring import await_reader
from ..errors import UserError
from ..nav.localise import SettingError
from ..progress import bar as progress_bar
from ..recording import read
from ..robot.drives import DriveError, live, recorded, way
from ..scene import Scene, load
from ..stopping import stop_on_signals
from ..tables import TableError
from ..touch.texture import model as texture
from ..touch.texture import train as texture_train
from ..touch.texture.change import notice
from ..touch.texture.drive import INSIDE_M, Drive, Stretch, over_tiles, place_of, stated, write
from ..touch.texture.lacking import lacking
from ..touch.texture.spectral import HAZARD, HAZARD_LEAST, SpectralModel

METHODS = "naive-bayes: the paper's equation 1 (default: spectra, calibrated on recordings held out)"
SPAN = re.compile(r"(?P<name>[^=/]+)(=(?P<first>[\d.]+)-(?P<last>[\d.]+))?")
EXAMPLE = "whisker texture train examples/surfaces --out model.json"


def add(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    p = add_action(actions, "train", "learn from one folder per surface, one CSV per recording", EXAMPLE, train)
    text = "a folder for each surface; with --drive or --live recordings of the drive are put into it first"
    p.add_argument("folder", metavar="DIR", help=text)
    add_drive(p)
    add_output(p, "--out", required=True, metavar="MODEL.JSON", help="the model, as JSON")
    p.add_argument("--method", choices=["naive-bayes", "default"], default="default", help=METHODS)
    p.add_argument("--window-ms", type=number_above(0.0), default=100.0, metavar="MS", help="length of a window")
    text = "of a drive, with --tile-m: how often the surface changes (default: once in fifty windows)"
    p.add_argument("--speed-m-s", type=number_above(0.0), metavar="V", help=text)
    p.add_argument(
        "--tile-m", type=number_above(0.0), metavar="L", help="length of one surface along a drive, with --speed-m-s"
    )
    example = "whisker texture classify examples/texture.json examples/surfaces/ROUGH/1.csv --window-ms 100 --json"
    p = add_action(actions, "classify", "classify the surface window by window", example, classify)
    p.add_argument("model", help="of 'whisker texture train'")
    p.add_argument("recording", help="a CSV file, or a folder as for 'train': then a confusion matrix")
    p.add_argument("--window-ms", type=number_above(0.0), default=100.0, metavar="MS", help="length of a window")
    p.add_argument("--sequential", action="store_true", help='answer as soon as sure, "unknown" after four windows')
    p.add_argument("--json", action="store_true", help="one object per line and window; of a folder: per surface")


def add_drive(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--drive", type=Path, metavar="FILE.MCAP", help="add this drive's recordings; of 'whisker record'"
    )
    parser.add_argument("--live", action="store_true", help="add those of a drive that a ring shows from now on")
    text = "of --live: stop after so many seconds"
    parser.add_argument("--seconds", type=number_above(0.0), default=30.0, metavar="S", help=text)
    text = "whose tiles were driven over, and whose robot.toml names the lanes"
    parser.add_argument("--scene", type=Path, metavar="SCENE", help=text)
    text = "where the robot was: a CSV file of poses, a robot's bag, or a scene folder with observations (default: --scene)"
    parser.add_argument("--way", type=Path, metavar="PATH", help=text)
    text = "in place of --way: all of the drive was on this surface, or from one second of it to another"
    parser.add_argument("--surface", type=_surface, action="append", metavar="NAME[=S-S]", help=text)
    text = "of floor whiskers, without --scene, such as 0,1"
    parser.add_argument("--lanes", type=lane_list(LANES), metavar="LIST", help=text)
    add_ring(parser)


def _surface(text: str) -> tuple[str, float, float]:
    """An argument's type: a surface, and from when to when of the drive, s."""
    found = SPAN.fullmatch(text)
    try:
        first, last = (float(found[part] or otherwise) for part, otherwise in (("first", "0"), ("last", "inf")))
    except (TypeError, ValueError):
        first, last = 1.0, 0.0
    if not first < last:
        raise argparse.ArgumentTypeError(f"'{text}' is no surface with times; give ROUGH, or ROUGH=3.5-20")
    return found["name"], first, last


def train(arguments: argparse.Namespace) -> int:
    window_ms = arguments.window_ms
    hazard = changes_a_window(arguments.speed_m_s, arguments.tile_m, window_ms)
    if add_recordings(arguments, window_ms) and len(texture.surface_files(arguments.folder)) < 2:
        print(f"{arguments.folder}: one surface so far; drive over another, and the model is learnt")
        return 0
    recordings, rate_hz = texture.read_training(arguments.folder, warn)
    files = texture.surface_files(arguments.folder)
    window = round(rate_hz * window_ms / 1000.0) if arguments.method == "default" else 0
    for file, samples in ((f, r) for name in files for f, r in zip(files[name], recordings[name], strict=True)):
        if len(samples) < window:
            text = (
                f"{len(samples)} samples; no window of the model will be longer, though --window-ms asks for {window}"
            )
            warn(f"{file}: {text}; remove it, or ask for less")
    try:
        if arguments.method == "default":
            with progress_bar(
                total=1, desc="train", bar_format="{desc} {bar} {percentage:3.0f} %", disable=None
            ) as bar:
                progress = lambda done, of: advance(bar, done, of)  # noqa: E731
                places = {name: list(map(place_of, some)) for name, some in files.items()}
                model = texture_train.train(recordings, rate_hz, window_ms, progress, hazard, places)
            every = [speed for some in files.values() for speed in texture.speeds(some)]
            model.speed_m_s = (min(every), max(every)) if every else None
            model.columns = texture.channel_names(next(iter(files.values()))[0])
        else:
            model = texture.TextureModel.train(recordings)
        model.save(arguments.out)
    except ValueError as error:
        raise TableError(arguments.folder, None, str(error)) from error
    print(f"{arguments.out}: {len(recordings)} classes: {', '.join(recordings)}")
    for line in report(model) if arguments.method == "default" else ():
        print(line)
    speeds = {name: texture.speeds(some) for name, some in files.items()}
    for line in lacking({name: list(map(place_of, some)) for name, some in files.items()}, speeds):
        print(line)
    return 0


def add_recordings(arguments: argparse.Namespace, window_ms: float) -> bool:
    """Put the recordings of --drive or --live into the folder, and say which they are; False: neither is given."""
    if arguments.drive is None and not arguments.live:
        return False
    if arguments.drive and arguments.live:
        raise UserError("texture train: --drive with --live; give one of them")
    if arguments.live and not arguments.surface:
        raise UserError(
            "texture train: --live without --surface; name the surface that is driven over, or record the drive and give it by "
            "--drive with --scene: the ring shows no poses"
        )
    scene = load(arguments.scene) if arguments.scene else None
    names = _lanes(arguments, scene)
    drive, name = _drive(arguments)
    found = _stretches(arguments, scene, names, drive, window_ms / 1000.0)
    write(Path(arguments.folder), name, found, _columns(Path(arguments.folder)))
    seconds, places = Counter(), {}
    for s in found:
        seconds[s.surface] += s.t_s[-1] - s.t_s[0]
        places.setdefault(s.surface, set()).add(s.place)
    for surface, total in sorted(seconds.items()):
        count = sum(s.surface == surface for s in found)
        print(
            f"{arguments.folder}/{surface}: {count} recordings added, {total:.1f} s, of {len(places[surface])} places"
        )
    return True


def _lanes(arguments, scene: Scene | None) -> dict[int, str]:
    """Names of the floor whiskers by lane."""
    if arguments.lanes is not None:
        return {lane: f"lane{lane}" for lane in arguments.lanes}
    if scene is None:
        raise UserError("texture train: neither --scene nor --lanes; say which lanes are floor whiskers")
    return {lane: w.name for lane, w in enumerate(scene.robot.whiskers) if w.role == "texture"}


def _drive(arguments) -> tuple[Drive, str]:
    """The samples, and a name that no other drive has."""
    if arguments.drive:
        with read(arguments.drive) as recording:
            drive, name = recorded(recording, warn), arguments.drive.stem
    else:
        stop, name = stop_on_signals(), "live"
        with await_reader(arguments.ring, arguments.wait, stop, arguments.ring_owner) as reader:
            drive = live(reader, arguments.seconds, float(LIMITS["clock_hz"]), stop, warn)
    return drive, f"{name}-{datetime.fromtimestamp(drive.began_ns / 1e9, UTC):%Y%m%dT%H%M%S}"


def _stretches(arguments, scene: Scene | None, names: dict[int, str], drive: Drive, least_s: float) -> list[Stretch]:
    """Those of the surfaces that were given, or that the way led over. DriveError without any."""
    if arguments.surface:
        start = drive.t_s[0]
        asked = [(surface, start + first, start + last) for surface, first, last in arguments.surface]
        found = [s for surface, *times in asked for s in stated(drive, names, surface, *times, least_s)]
        if not found:
            raise DriveError(
                f"{arguments.drive or arguments.ring}: no window of samples at these times; give later or longer ones"
            )
        return found
    if scene is None:
        raise UserError("texture train: --drive with neither --scene nor --surface; say what was driven over")
    source = arguments.way or arguments.scene
    whiskers = {lane: w for lane, w in enumerate(scene.robot.whiskers) if lane in names and w.tip_m}
    found = over_tiles(drive, way(source, scene, warn), whiskers, scene.arena, least_s)
    if not found:
        text = f"no tip moved for a window's time on one known tile, {100 * INSIDE_M:g} cm and two deviations inside"
        raise DriveError(f"{source}: {text}; drive across the tiles, or give better poses by --way")
    return found


def _columns(folder: Path) -> tuple[str, ...]:
    """The names of the channels of the recordings that are there, if they have two; else x, y."""
    there = next(iter(sorted(folder.glob("[!.]*/[!.]*.csv"))), None)
    names = texture.channel_names(there) if there else []
    return tuple(names) if len(names) == 2 else ("x", "y")


def advance(bar: Any, done: int, of: int) -> None:
    bar.total = of
    bar.update(done - bar.n)


def report(model: Any) -> list[str]:
    """Figures of recordings held out, and what there was too little data to learn, a line each."""
    f, ms = model.figures, 1000.0 / model.rate_hz
    units = f["held_out_units"]
    lines = [
        f"held out, windows of {f['window_samples'] * ms:.4g} ms: {100 * f['held_out_accuracy']:.1f} % right, "
        f"{100 * f['refused']:.1f} % unknown, calibration error {f['calibration_error']:.3f}",
        f"held out, as soon as sure: {100 * f['sequential_accuracy']:.1f} % right after "
        f"{f['sequential_samples'] * ms:.4g} ms on average, calibration error {f['sequential_calibration_error']:.3f}",
        f"unknown by {units} {'places' if units < f['recordings'] else 'recordings'}: at most "
        f"{100 * f['refused_level']:.0f} % of new windows of the surfaces",
    ]
    return lines + [f"not learned: {text}" for text in model.not_learned()]


def changes_a_window(speed_m_s: float | None, tile_m: float | None, window_ms: float) -> float:
    """Changes of surface per window."""
    if speed_m_s is None and tile_m is None:
        return HAZARD
    if speed_m_s is None or tile_m is None:
        raise SettingError("--speed-m-s, --tile-m: give both, above 0, as in '--speed-m-s 0.1 --tile-m 0.5'")
    changes = speed_m_s * window_ms / 1000.0 / tile_m
    if not HAZARD_LEAST <= changes <= 1.0:
        raise SettingError(f"--speed-m-s, --tile-m: {changes:g} surfaces a window; give {HAZARD_LEAST:g} to 1")
    return changes


def classify(arguments: argparse.Namespace) -> int:
    model, given = texture.load(arguments.model), Path(arguments.recording)
    if given.is_dir():
        heard = classify_folder(arguments, model)
    else:
        found, samples = decisions(arguments, model, given)
        heard = {given: samples}
        for decision in found:
            text = f"{decision.t_s:.3f} s  {decision.label}  {decision.confidence:.3f}"
            print(json.dumps(plain(vars(decision))) if arguments.json else text)
    if isinstance(model, SpectralModel):
        speeds, places = texture.speeds(list(heard)), list(map(place_of, heard))
        speed_m_s = float(np.median(speeds)) if speeds else None
        if changed := notice(model, list(heard.values()), places, speed_m_s):
            warn(f"{given}: {changed}")
    return 0


def decisions(arguments: argparse.Namespace, model: Any, path: Path) -> tuple[list, np.ndarray]:
    """Of a recording, and its samples; its faults are warned of."""
    t_s, samples = texture.read_recording(path, getattr(model, "columns", None), warn)
    if samples.shape[1] != model.channels:
        text = f"{samples.shape[1]} channels, but the model has {model.channels}; use recordings of the same sensor"
        raise TableError(path, 1, text)
    for fault in texture.rate_faults(t_s, model.rate_hz) if hasattr(model, "rate_hz") else ():
        warn(f"{path}: {fault}")
    judged = texture.classify(model, t_s, samples, arguments.window_ms, arguments.sequential)
    if not judged:
        warn(f"{path}: {len(samples)} samples and no decision; give a longer recording, or a shorter --window-ms")
    return judged, samples


def classify_folder(arguments: argparse.Namespace, model: Any) -> dict[Path, np.ndarray]:
    """A row for each surface's folder: decisions, and the share of each answer in percent."""
    files = texture.surface_files(arguments.recording)
    if not files:
        raise TableError(arguments.recording, None, "no surface folder; give one folder per surface, or one CSV file")
    answers, heard = {}, {}
    for name, some in progress_bar(files.items(), desc="classify", unit="surface", disable=None):
        answers[name] = Counter()
        for path in some:
            found, heard[path] = decisions(arguments, model, path)
            answers[name] += Counter(d.label for d in found)
    columns = [*model.classes, "unknown"]
    for line in rows(answers, columns) if arguments.json else table(answers, columns):
        print(line)
    for name in sorted(set(files) - set(model.classes)):
        warn(f"{arguments.recording}: folder '{name}' is no class of the model: {', '.join(model.classes)}")
    return heard


def rows(answers: dict[str, Counter], columns: list[str]) -> list[str]:
    """A JSON object for each surface."""
    return [
        json.dumps({"surface": name, "decisions": found.total()} | {c: found[c] for c in columns})
        for name, found in answers.items()
    ]


def table(answers: dict[str, Counter], columns: list[str]) -> list[str]:
    width, cell = max(map(len, [*answers, "surface"])), max(8, *(len(c) + 2 for c in columns))
    right, total = sum(found[name] for name, found in answers.items()), sum(found.total() for found in answers.values())
    worst = min(answers, key=lambda name: answers[name][name] / max(1, answers[name].total()))
    taken = answers[worst].most_common(2)
    mostly = next((f", else mostly {label}" for label, _ in taken if label != worst), "")
    share = 100 * answers[worst][worst] / max(1, answers[worst].total())
    lines = [f"{100 * right / max(1, total):.1f} % of {total} windows right; least {worst}, {share:.1f} %{mostly}"]
    lines += [f"{'surface':{width}}{'windows':>9}" + "".join(f"{c:>{cell}}" for c in columns)]
    for name, found in answers.items():
        shares = [100 * found[c] / max(1, found.total()) for c in columns]
        lines.append(f"{name:{width}}{found.total():9}" + "".join(f"{s:{cell - 2}.1f} %" for s in shares))
    return lines
