"""`whisker radial`: fits contacts of known radius and predicts others (whisker.radial)."""

import json

from .. import radial
from ..tables import TableError, unwritable
from . import add_action, plain

EXAMPLE = "whisker radial fit contacts.csv --out model.json"


def add(parser) -> None:
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    p = add_action(actions, "fit", "fit contacts of known radius", EXAMPLE, fit)
    p.add_argument("contacts")
    p.add_argument("--out", required=True, metavar="MODEL.JSON")
    p.add_argument("--model", choices=["linear", "default"], default="default", help="default: linear (equation 3)")
    example = "whisker radial predict model.json contacts.csv --json"
    p = add_action(actions, "predict", "tell the radius of each contact", example, predict)
    p.add_argument("model")
    p.add_argument("contacts")
    p.add_argument("--json", action="store_true", help="one object per line and contact")


def fit(arguments) -> int:
    whisks = radial.read_whisks(arguments.contacts, with_radius=True)
    try:
        model = radial.RadialModel.fit(whisks.peak_counts, whisks.radius_mm)
        model.save(arguments.out)
    except ValueError as error:
        raise TableError(arguments.contacts, None, str(error)) from error
    except OSError as error:
        raise unwritable(arguments.out, error) from error
    print(f"{arguments.out}: {len(whisks.contact)} contacts, standard error {model.sigma_mm:.2f} mm")
    return 0


def predict(arguments) -> int:
    model = radial.RadialModel.load(arguments.model)
    whisks = radial.read_whisks(arguments.contacts, with_radius=False)
    for contact, peak in zip(whisks.contact, whisks.peak_counts, strict=True):
        mm, sigma = model.predict(float(peak))
        out = {"contact": contact, "radius_mm": mm, "sigma_mm": sigma, "type": model.contact_type(mm)}
        print(json.dumps(plain(out)) if arguments.json else f"{contact}  {mm:.2f} +- {sigma:.2f} mm  {out['type']}")
    return 0
