"""The command line `whisker`. Subcommands read files and print; the work is done by the modules they name."""

import argparse
import json
import sys

from . import localise, radial, texture
from .localise import SettingError
from .scene import PRIOR, SceneError, load
from .tables import TableError

TROUBLE = 2  # exit code: arguments or the structure of a file; one line on standard error says which


class Parser(argparse.ArgumentParser):
    """Complaints are one line; help keeps its line breaks."""

    def __init__(self, **options):
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False, **options)

    def error(self, message: str):
        self.exit(TROUBLE, f"{self.prog}: {message}; see '{self.prog} --help'\n")


def main(argv: list[str] | None = None) -> int:
    arguments = _parser().parse_args(argv)
    try:
        return arguments.run(arguments)
    except (SceneError, TableError, SettingError) as error:
        print(f"whisker: {error}", file=sys.stderr)
        return TROUBLE
    except BrokenPipeError:  # the reader of our output has gone: not our trouble
        sys.stderr.close()
        return 0


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="whisker",
        description="Whiskered robots: tactile perception and localisation by touch.",
        epilog="example:\n  whisker localise scenes/paper --filter grid --json",
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _add_localise(commands)
    _add_texture(commands)
    _add_radial(commands)
    return parser


def _command(commands, name: str, text: str, example: str, run=None):
    made = commands.add_parser(name, help=text, description=text, epilog=f"example:\n  {example}")
    if run:
        made.set_defaults(run=run)
    return made


def _add_localise(commands) -> None:
    example = "whisker localise scenes/paper --filter grid --set grid.cell_m=0.05 --out est.csv --json"
    p = _command(commands, "localise", "where the robot was, row by row of a scene folder", example, _localise)
    p.add_argument("scene", nargs="?", help="folder with arena.toml, robot.toml, prior.toml, observations.csv")
    p.add_argument("--filter", default="grid", metavar="NAME", help="one of --list-filters (default: %(default)s)")
    p.add_argument("--seed", type=int, default=0, help="for filters that use chance; those of today do not")
    p.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="change a setting, see --list-settings"
    )
    p.add_argument("--out", metavar="EST.CSV", help="write t_s, x_m, y_m, theta_rad, confidence of every row")
    p.add_argument("--json", action="store_true", help="print the summary as one line of JSON")
    p.add_argument("--list-filters", action="store_true", help="print the filters' names and leave")
    p.add_argument("--list-settings", action="store_true", help="print the settings with defaults and ranges and leave")


def _localise(arguments) -> int:
    if arguments.list_filters:
        print("\n".join(localise.filter_names()))
        return 0
    if arguments.list_settings:
        for name, standard, low, high in localise.settings_list():
            print(f"{name}={standard:g} ({low:g} to {high:g})")
        return 0
    if arguments.scene is None:
        raise SettingError("localise: no scene folder given; name one, or use --list-filters")
    scene = load(arguments.scene)
    if scene.prior is None:
        raise SceneError(f'{arguments.scene}/{PRIOR}: missing; write one, kind = "uniform" if nothing is known')
    for warning in scene.warnings():
        print(f"whisker: warning: {warning}", file=sys.stderr)
    observations = localise.read_observations(localise.observations_path(arguments.scene), scene)
    result = localise.run(arguments.filter, scene, observations, _settings(arguments.set))
    if arguments.out:
        localise.write_estimates(arguments.out, result, observations)
    summary = localise.summary(result, observations.truth)
    print(json.dumps(summary) if arguments.json else "\n".join(f"{key}: {value}" for key, value in summary.items()))
    return 0


def _settings(pairs: list[str]) -> dict[str, float]:
    settings = {}
    for pair in pairs:
        key, _, value = pair.partition("=")
        try:
            settings[key] = float(value)
        except ValueError:
            raise SettingError(f"--set {pair}: not KEY=NUMBER, as in grid.cell_m=0.05") from None
    return settings


def _add_texture(commands) -> None:
    example = "whisker texture train recordings --out model.json"
    actions = _command(commands, "texture", "learn and tell floor surfaces", example).add_subparsers(
        dest="action", required=True, metavar="ACTION"
    )
    p = _command(actions, "train", "learn from one folder per surface, one CSV per recording", example, _texture_train)
    p.add_argument("folder")
    p.add_argument("--out", required=True, metavar="MODEL.JSON")
    p.add_argument("--method", choices=["naive-bayes", "default"], default="default", help="default: naive-bayes")
    example = "whisker texture classify model.json drive.csv --window-ms 100 --json"
    p = _command(actions, "classify", "tell the surface window by window", example, _texture_classify)
    p.add_argument("model")
    p.add_argument("recording")
    p.add_argument("--window-ms", type=float, default=100.0, help="length of a window (default: %(default)s)")
    p.add_argument("--json", action="store_true", help="one object per line and window")


def _texture_train(arguments) -> int:
    recordings = texture.read_folder(arguments.folder)
    try:
        texture.TextureModel.train(recordings).save(arguments.out)
    except ValueError as error:
        raise TableError(arguments.folder, None, str(error)) from error
    except OSError as error:
        raise _unwritable(arguments.out, error) from error
    print(f"{arguments.out}: {len(recordings)} classes: {', '.join(recordings)}")
    return 0


def _texture_classify(arguments) -> int:
    if not 0.0 < arguments.window_ms < float("inf"):
        raise SettingError(f"--window-ms {arguments.window_ms:g}: not a length of time; use 100")
    model = texture.TextureModel.load(arguments.model)
    t_s, samples = texture.read_recording(arguments.recording)
    if samples.shape[1] != len(model.low):
        text = f"{samples.shape[1]} channels, but the model has {len(model.low)}; use recordings of the same sensor"
        raise TableError(arguments.recording, 1, text)
    for decision in texture.classify(model, t_s, samples, arguments.window_ms):
        if arguments.json:
            print(json.dumps(_plain(vars(decision))))
        else:
            border = " (border)" if decision.border else ""
            print(f"{decision.t_s:.3f} s  {decision.label}  {decision.confidence:.3f}{border}")
    return 0


def _add_radial(commands) -> None:
    example = "whisker radial fit contacts.csv --out model.json"
    actions = _command(commands, "radial", "learn and tell the distance of contacts along a whisker", example)
    actions = actions.add_subparsers(dest="action", required=True, metavar="ACTION")
    p = _command(actions, "fit", "fit contacts of known radius", example, _radial_fit)
    p.add_argument("contacts")
    p.add_argument("--out", required=True, metavar="MODEL.JSON")
    p.add_argument("--model", choices=["linear", "default"], default="default", help="default: linear (equation 3)")
    example = "whisker radial predict model.json contacts.csv --json"
    p = _command(actions, "predict", "tell the radius of each contact", example, _radial_predict)
    p.add_argument("model")
    p.add_argument("contacts")
    p.add_argument("--json", action="store_true", help="one object per line and contact")


def _radial_fit(arguments) -> int:
    whisks = radial.read_whisks(arguments.contacts, with_radius=True)
    try:
        model = radial.RadialModel.fit(whisks.peak_counts, whisks.radius_mm)
        model.save(arguments.out)
    except ValueError as error:
        raise TableError(arguments.contacts, None, str(error)) from error
    except OSError as error:
        raise _unwritable(arguments.out, error) from error
    print(f"{arguments.out}: {len(whisks.contact)} contacts, standard error {model.sigma_mm:.2f} mm")
    return 0


def _radial_predict(arguments) -> int:
    model = radial.RadialModel.load(arguments.model)
    whisks = radial.read_whisks(arguments.contacts, with_radius=False)
    for contact, peak in zip(whisks.contact, whisks.peak_counts, strict=True):
        mm, sigma = model.predict(float(peak))
        out = {"contact": contact, "radius_mm": mm, "sigma_mm": sigma, "type": model.contact_type(mm)}
        print(json.dumps(_plain(out)) if arguments.json else f"{contact}  {mm:.2f} +- {sigma:.2f} mm  {out['type']}")
    return 0


def _plain(values: dict) -> dict:
    """JSON has no nan: what could not be read is null."""
    return {key: None if isinstance(value, float) and value != value else value for key, value in values.items()}


def _unwritable(path: str, error: OSError) -> TableError:
    return TableError(path, None, f"cannot be written ({error.strerror}); choose another --out")


if __name__ == "__main__":
    sys.exit(main())
