"""`whisker texture`: learns surfaces from recordings and tells them apart (whisker.touch.texture)."""

import json

from ..arguments import add_action, plain
from ..nav.localise import SettingError
from ..tables import TableError, unwritable
from ..touch.texture import model as texture
from ..touch.texture import train as texture_train

METHODS = "default: spectra, calibrated on recordings held out; naive-bayes: the paper's equation 1"
EXAMPLE = "whisker texture train recordings --out model.json"


def add(parser) -> None:
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    p = add_action(actions, "train", "learn from one folder per surface, one CSV per recording", EXAMPLE, train)
    p.add_argument("folder")
    p.add_argument("--out", required=True, metavar="MODEL.JSON")
    p.add_argument("--method", choices=["naive-bayes", "default"], default="default", help=METHODS)
    p.add_argument("--window-ms", type=float, default=100.0, help="window to train for, of method default: %(default)s")
    example = "whisker texture classify model.json drive.csv --window-ms 100 --json"
    p = add_action(actions, "classify", "tell the surface window by window", example, classify)
    p.add_argument("model")
    p.add_argument("recording")
    p.add_argument("--window-ms", type=float, default=100.0, help="length of a window (default: %(default)s)")
    p.add_argument("--sequential", action="store_true", help='answer as soon as sure, "unknown" after four windows')
    p.add_argument("--json", action="store_true", help="one object per line and window")


def train(arguments) -> int:
    window_ms = length_of_time(arguments.window_ms)
    recordings, rate_hz = texture.read_training(arguments.folder)
    try:
        if arguments.method == "default":
            texture_train.train(recordings, rate_hz, window_ms).save(arguments.out)
        else:
            texture.TextureModel.train(recordings).save(arguments.out)
    except ValueError as error:
        raise TableError(arguments.folder, None, str(error)) from error
    except OSError as error:
        raise unwritable(arguments.out, error) from error
    print(f"{arguments.out}: {len(recordings)} classes: {', '.join(recordings)}")
    return 0


def length_of_time(window_ms: float) -> float:
    if not 0.0 < window_ms < float("inf"):
        raise SettingError(f"--window-ms {window_ms:g}: not a length of time; use 100")
    return window_ms


def classify(arguments) -> int:
    window_ms = length_of_time(arguments.window_ms)
    model = texture.load(arguments.model)
    t_s, samples = texture.read_recording(arguments.recording)
    if samples.shape[1] != model.channels:
        text = f"{samples.shape[1]} channels, but the model has {model.channels}; use recordings of the same sensor"
        raise TableError(arguments.recording, 1, text)
    for decision in texture.classify(model, t_s, samples, window_ms, arguments.sequential):
        if arguments.json:
            print(json.dumps(plain(vars(decision))))
        else:
            border = " (border)" if decision.border else ""
            print(f"{decision.t_s:.3f} s  {decision.label}  {decision.confidence:.3f}{border}")
    return 0
