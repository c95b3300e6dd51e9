"""`whisker radial`: fits contacts of known radius and predicts others (crunchbot.touch.radial)."""

import argparse
import json

import numpy as np

from ..arguments import add_action, add_output, plain, warn
from ..bridge.nodes import check_node
from ..tables import TableError
from ..touch.contact_filter import ContactFilter, Reports
from ..touch.radial import model as radial

EXAMPLE = "whisker radial fit examples/contacts.csv --out contacts.json"
COLUMNS = "whisk_rad_s and base_rad_s, or push_mm_s, or depth_mm; direction_deg of the touch"
DOUBTED_LEAST = 3  # fewer contacts say nothing of the whisker
KINDS = """paper or linear: equation 3, a line through the peaks; rational: a curve instead; press: a regression at depths of
a push, which answers during it, and the curve where it doubts (default: the one that predicts left-out places best)"""


def add(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    p = add_action(actions, "fit", "fit contacts of known radius", EXAMPLE, fit)
    p.add_argument("contacts", help="CSV: contact, radius_mm, t_s, channels; where known " + COLUMNS)
    add_output(p, "--out", required=True, metavar="MODEL.JSON", help="the model, as JSON")
    p.add_argument("--model", choices=radial.MODELS, default="default", help=KINDS)
    p.add_argument("--json", action="store_true", help="the errors as one object on one line")
    example = "whisker radial predict examples/radial.json examples/contacts.csv --json"
    p = add_action(actions, "predict", "estimate the radius of each contact", example, predict)
    p.add_argument("model", help="of 'whisker radial fit'")
    p.add_argument("contacts", help="CSV as for fit; radius_mm is not read and may be absent")
    p.add_argument("--json", action="store_true", help="one object per line and contact")
    text = "a press model's answers as each contact grows, one line for every tenth of its samples"
    p.add_argument("--during", action="store_true", help=text)
    example = "whisker radial follow examples/radial.json examples/contacts.csv --json"
    p = add_action(actions, "follow", "estimate where each contact is while it is pressed", example, follow)
    p.add_argument("model", help="of any kind, from contacts that tell how the base moved")
    p.add_argument("contacts", help="CSV as for fit, with whisk_rad_s or push_mm_s; radius_mm is not read")
    p.add_argument("--json", action="store_true", help="one object per line, one every 20 ms at 2 kHz")


def fit(arguments: argparse.Namespace) -> int:
    whisks = radial.read_whisks(arguments.contacts, with_radius=True, warn=warn)
    try:
        found = radial.fit(whisks, arguments.model)
        radial.save(found.model, arguments.out)
    except ValueError as error:
        raise TableError(arguments.contacts, None, str(error)) from error
    if arguments.json:
        tried = {
            name: dict(zip(("place_mm", "contact_mm"), errors, strict=True)) for name, errors in found.tried.items()
        }
        print(json.dumps({"contacts": len(whisks.contact), "place_mm": found.place_mm, "tried": tried}))
        return 0
    paper = found.tried.get("linear", (found.place_mm,))[0]
    print(f"a place that was left out is found to {found.place_mm:.2f} mm RMS; by the paper's line to {paper:.2f} mm")
    print("model      places left out  contacts left out  (RMS error, mm)")
    for name, errors in found.tried.items():
        mark = "  chosen" if errors == (found.place_mm, found.contact_mm) else ""
        print(f"{name:<10}{errors[0]:>16.2f}{errors[1]:>19.2f}{mark}")
    print(f"{arguments.out}: {len(whisks.contact)} contacts")
    return 0


def predict(arguments: argparse.Namespace) -> int:
    model = radial.load(arguments.model)
    if arguments.during and not isinstance(model, radial.PressModel):
        raise TableError(arguments.model, None, "only a press model answers during a press; fit with '--model press'")
    whisks = radial.read_whisks(arguments.contacts, with_radius=False, warn=warn)
    check_node(model.node, whisks.node, arguments.model)
    doubted = 0
    for contact, recorded, peak in zip(whisks.contact, whisks.recorded, whisks.peak_counts, strict=True):
        count = len(recorded.t_s)
        for end in (count * np.arange(1, 11) // 10) if arguments.during else (count,):
            sure = _predict(arguments, model, contact, recorded.until(end), None if arguments.during else peak)
        doubted += sure < radial.PressModel.DOUBTED
    if doubted >= DOUBTED_LEAST and 2 * doubted > len(whisks.contact):
        text = f"{doubted} of {len(whisks.contact)} contacts are unlike those of calibration"
        warn(f"{arguments.contacts}: {text}; if whisker, sensor or channels have changed, record and fit anew")
    return 0


def _predict(arguments, model, contact: str, recorded: radial.Contact, peak: float | None) -> float:
    """One line on a contact, whole or so far; its confidence."""
    try:
        found = radial.estimate(model, recorded, peak)
    except ValueError as error:
        raise TableError(arguments.contacts, 1, f"{error}; give the columns it was fitted on") from error
    at_s = {"t_s": recorded.t_s[-1] - recorded.t_s[0]} if arguments.during else {}
    if arguments.json:
        members = {name: value for name, value in found._asdict().items() if value is not None}
        print(json.dumps(plain({"contact": contact} | at_s | members)))
        return found.confidence
    after = f"  after {at_s['t_s']:.3f} s" if at_s else ""
    direction = "" if found.direction_deg is None else f"  {found.direction_deg:g} degrees"
    print(
        f"{contact}{after}  {found.radius_mm:.2f} +- {found.sigma_mm:.2f} mm  {found.type}  {found.confidence:.2f}{direction}"
    )
    return found.confidence


def follow(arguments: argparse.Namespace) -> int:
    model = radial.load(arguments.model)
    if model.plug is None:
        text = "it holds no plug; fit it anew, with the column whisk_rad_s, push_mm_s or depth_mm in the contacts"
        raise TableError(arguments.model, None, text)
    whisks = radial.read_whisks(arguments.contacts, with_radius=False, warn=warn)
    check_node(model.node, whisks.node, arguments.model)
    for contact, recorded in zip(whisks.contact, whisks.recorded, strict=True):
        try:
            held, bases, tilts = ContactFilter.calibrated(model.plug, recorded)
        except ValueError as error:
            raise TableError(arguments.contacts, 1, f"contact {contact}: {error}") from error
        reported = held.run(bases, tilts)
        for k in range(len(reported.sample)) if arguments.json else range(len(reported.sample))[-1:]:
            _follow(arguments, contact, recorded.t_s[reported.sample[k]] - recorded.t_s[0], reported, k)
        if not len(reported.sample):
            print(json.dumps({"contact": contact}) if arguments.json else f"{contact}  no contact")
    return 0


def _follow(arguments, contact: str, at_s: float, reported: Reports, k: int) -> None:
    """One line on a contact at a time; angles in degrees about the unbent whisker."""
    x, y = 1e3 * reported.point[k]
    sd_x, sd_y = 1e3 * np.sqrt(np.diag(reported.point_cov[k]))
    normal, normal_sd = np.degrees([reported.normal_rad[k], reported.normal_sd[k]])
    if arguments.json:
        made = {"contact": contact, "t_s": at_s, "point_mm": [x, y], "point_sd_mm": [sd_x, sd_y]}
        made |= {"normal_deg": normal, "normal_sd_deg": normal_sd, "motion": reported.motion[k]}
        made |= {name: bool(getattr(reported, name)[k]) for name in ("sure", "faced")}
        made |= {
            name: getattr(reported, name)[k]
            for name in ("sweep", "corner", "tip", "slip", "speed", "speed_sd", "curvature", "other")
        }
        print(json.dumps(plain(made)))
        return
    kind = "tip" if reported.tip[k] > 0.5 else "corner" if reported.corner[k] > 0.5 else "shaft"
    print(
        f"{contact}  after {at_s:.3f} s  ({x:.1f} +- {sd_x:.1f}, {y:.1f} +- {sd_y:.1f}) mm  "
        f"normal {normal:.0f} +- {normal_sd:.0f} degrees  {kind}  {reported.motion[k]}{'' if reported.sure[k] else '  not sure'}"
    )
