"""`whisker radial`: fits contacts of known radius and predicts others (whisker.touch.radial)."""

import json

from ..arguments import add_action, plain
from ..bridge.nodes import check_node
from ..tables import TableError, unwritable
from ..touch.radial import model as radial

EXAMPLE = "whisker radial fit contacts.csv --out model.json"
KINDS = """paper or linear: equation 3, a line through the peaks; quadratic, rational: a curve instead; default: whole
whisks (onset, rate, duration, creep), with an uncertainty for each contact"""


def add(parser) -> None:
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    p = add_action(actions, "fit", "fit contacts of known radius", EXAMPLE, fit)
    p.add_argument("contacts", help="CSV: contact, radius_mm, t_s, channels, whisk_rad_s and base_rad_s where known")
    p.add_argument("--out", required=True, metavar="MODEL.JSON")
    p.add_argument("--model", choices=radial.MODELS, default="default", help=KINDS)
    example = "whisker radial predict model.json contacts.csv --json"
    p = add_action(actions, "predict", "tell the radius of each contact", example, predict)
    p.add_argument("model")
    p.add_argument("contacts", help="CSV as for fit; radius_mm is not read and may be absent")
    p.add_argument("--json", action="store_true", help="one object per line and contact")


def fit(arguments) -> int:
    whisks = radial.read_whisks(arguments.contacts, with_radius=True)
    try:
        model, error_mm = radial.fit(whisks, arguments.model)
        radial.save(model, arguments.out)
    except ValueError as error:
        raise TableError(arguments.contacts, None, str(error)) from error
    except OSError as error:
        raise unwritable(arguments.out, error) from error
    print(f"{arguments.out}: {len(whisks.contact)} contacts, standard error {error_mm:.2f} mm")
    return 0


def predict(arguments) -> int:
    model = radial.load(arguments.model)
    whisks = radial.read_whisks(arguments.contacts, with_radius=False)
    check_node(model.node, whisks.node, arguments.model)
    for contact, recorded, peak in zip(whisks.contact, whisks.recorded, whisks.peak_counts, strict=True):
        try:
            told = radial.estimate(model, recorded, peak)
        except ValueError as error:
            raise TableError(arguments.contacts, 1, f"{error}; give the channels it was fitted on") from error
        line = f"{contact}  {told.radius_mm:.2f} +- {told.sigma_mm:.2f} mm  {told.type}  {told.confidence:.2f}"
        print(json.dumps(plain({"contact": contact} | told._asdict())) if arguments.json else line)
    return 0
