"""`whisker texture`: learns surfaces from recordings and classifies them (crunchbot.touch.texture)."""

import argparse
import json
from collections import Counter
from pathlib import Path
from typing import Any

from ..arguments import add_action, add_output, plain, warn
from ..nav.localise import SettingError
from ..progress import bar as progress_bar
from ..tables import TableError
from ..touch.texture import model as texture
from ..touch.texture import train as texture_train
from ..touch.texture.spectral import HAZARD, HAZARD_LEAST

METHODS = "default: spectra, calibrated on recordings held out; naive-bayes: the paper's equation 1"
EXAMPLE = "whisker texture train examples/surfaces --out model.json"


def add(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    p = add_action(actions, "train", "learn from one folder per surface, one CSV per recording", EXAMPLE, train)
    p.add_argument("folder")
    add_output(p, "--out", required=True, metavar="MODEL.JSON")
    p.add_argument("--method", choices=["naive-bayes", "default"], default="default", help=METHODS)
    p.add_argument("--window-ms", type=float, default=100.0, help="window to train for, of method default: %(default)s")
    text = "of a drive, with --tile-m: how often the surface changes; default: once in fifty windows"
    p.add_argument("--speed-m-s", type=float, help=text)
    p.add_argument("--tile-m", type=float, help="length of one surface along a drive, with --speed-m-s")
    example = "whisker texture classify examples/texture.json examples/surfaces/ROUGH/1.csv --window-ms 100 --json"
    p = add_action(actions, "classify", "classify the surface window by window", example, classify)
    p.add_argument("model")
    p.add_argument("recording", help="a CSV file, or a folder as for 'train': then a confusion matrix")
    p.add_argument("--window-ms", type=float, default=100.0, help="length of a window")
    p.add_argument("--sequential", action="store_true", help='answer as soon as sure, "unknown" after four windows')
    p.add_argument("--json", action="store_true", help="one object per line and window; of a folder: per surface")


def train(arguments: argparse.Namespace) -> int:
    window_ms = length_of_time(arguments.window_ms)
    hazard = changes_a_window(arguments.speed_m_s, arguments.tile_m, window_ms)
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
                model = texture_train.train(recordings, rate_hz, window_ms, progress, hazard)
            model.columns = texture.channel_names(next(iter(files.values()))[0])
        else:
            model = texture.TextureModel.train(recordings)
        model.save(arguments.out)
    except ValueError as error:
        raise TableError(arguments.folder, None, str(error)) from error
    print(f"{arguments.out}: {len(recordings)} classes: {', '.join(recordings)}")
    for line in report(model) if arguments.method == "default" else ():
        print(line)
    return 0


def advance(bar: Any, done: int, of: int) -> None:
    bar.total = of
    bar.update(done - bar.n)


def report(model: Any) -> list[str]:
    """Figures of recordings held out, and what there was too little data to learn, a line each."""
    f, ms = model.figures, 1000.0 / model.rate_hz
    lines = [
        f"held out, windows of {f['window_samples'] * ms:.4g} ms: {100 * f['held_out_accuracy']:.1f} % right, "
        f"{100 * f['refused']:.1f} % unknown, calibration error {f['calibration_error']:.3f}",
        f"held out, as soon as sure: {100 * f['sequential_accuracy']:.1f} % right after "
        f"{f['sequential_samples'] * ms:.4g} ms on average, calibration error {f['sequential_calibration_error']:.3f}",
        f"unknown by {f['recordings']} recordings: at most {100 * f['refused_level']:.0f} % of new windows of the surfaces",
    ]
    return lines + [f"not learned: {text}" for text in model.not_learned()]


def length_of_time(window_ms: float) -> float:
    if not 0.0 < window_ms < float("inf"):
        raise SettingError(f"--window-ms {window_ms:g}: not a length of time; use 100")
    return window_ms


def changes_a_window(speed_m_s: float | None, tile_m: float | None, window_ms: float) -> float:
    """Changes of surface per window."""
    if speed_m_s is None and tile_m is None:
        return HAZARD
    if speed_m_s is None or tile_m is None or not (speed_m_s > 0.0 and tile_m > 0.0):
        raise SettingError("--speed-m-s, --tile-m: give both, above 0, as in '--speed-m-s 0.1 --tile-m 0.5'")
    changes = speed_m_s * window_ms / 1000.0 / tile_m
    if not HAZARD_LEAST <= changes <= 1.0:
        raise SettingError(f"--speed-m-s, --tile-m: {changes:g} surfaces a window; give {HAZARD_LEAST:g} to 1")
    return changes


def classify(arguments: argparse.Namespace) -> int:
    window_ms = length_of_time(arguments.window_ms)
    model = texture.load(arguments.model)
    if Path(arguments.recording).is_dir():
        return classify_folder(arguments, model, window_ms)
    for decision in decisions(arguments, model, arguments.recording, window_ms):
        if arguments.json:
            print(json.dumps(plain(vars(decision))))
        else:
            print(f"{decision.t_s:.3f} s  {decision.label}  {decision.confidence:.3f}")
    return 0


def decisions(arguments: argparse.Namespace, model: Any, path: str | Path, window_ms: float) -> list:
    """Classifies one recording; its faults are warned of."""
    t_s, samples = texture.read_recording(path, getattr(model, "columns", None), warn)
    if samples.shape[1] != model.channels:
        text = f"{samples.shape[1]} channels, but the model has {model.channels}; use recordings of the same sensor"
        raise TableError(path, 1, text)
    for fault in texture.rate_faults(t_s, model.rate_hz) if hasattr(model, "rate_hz") else ():
        warn(f"{path}: {fault}")
    found = texture.classify(model, t_s, samples, window_ms, arguments.sequential)
    if not found:
        warn(f"{path}: {len(samples)} samples and no decision; give a longer recording, or a shorter --window-ms")
    return found


def classify_folder(arguments: argparse.Namespace, model: Any, window_ms: float) -> int:
    """A row for each surface's folder: decisions, and the share of each answer in percent."""
    files = texture.surface_files(arguments.recording)
    if not files:
        raise TableError(arguments.recording, None, "no surface folder; give one folder per surface, or one CSV file")
    answers = {}
    for name, some in progress_bar(files.items(), desc="classify", unit="surface", disable=None):
        answers[name] = Counter(d.label for file in some for d in decisions(arguments, model, file, window_ms))
    columns = [*model.classes, "unknown"]
    for line in rows(answers, columns) if arguments.json else table(answers, columns):
        print(line)
    for name in sorted(set(files) - set(model.classes)):
        warn(f"{arguments.recording}: folder '{name}' is no class of the model: {', '.join(model.classes)}")
    return 0


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
