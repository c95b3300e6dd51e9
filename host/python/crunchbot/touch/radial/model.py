"""Radial distance of a contact: the paper's peak and line per whisker (equations 2 and 3), the choice among all models by
the places left out; calibration recordings and model files."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...fields import Fields
from ...files import read_json
from ...native import as_doubles, doubles, ffi, lib
from ...outputs import put
from ...tables import TableError, Warn, ignore, numbers, read_columns
from .curve import CurveModel, Known, peak, peak_of, radii_of
from .faults import faulty, radii_of_contacts
from .plug import Plug
from .press import PressModel
from .push import TIP_MM, Contact, presses_of

FORMAT = "whisker radial model 1"
FIELDS = ("a1", "a0", "sigma_mm", "low_mm", "high_mm")
CURVE_FORMAT = "whisker radial curve model 2"
PRESS_FORMAT = "whisker radial press model 2"
GONE = "whisker radial whisk model 1"  # of whole whisks, which nothing answers by any more
# How the base moves: turn commanded, turn as the base reports it, translation, depth. As the members of Contact.
MOTION_COLUMNS = {
    "whisk_rad_s": "whisk_rad_s",
    "base_rad_s": "reported_rad_s",
    "push_mm_s": "push_mm_s",
    "depth_mm": "depth_mm",
}
DIRECTION_COLUMN = "direction_deg"  # of the touch about the shaft
NODE_MOST = 2**32 - 1
NODE_COLUMN = "node"  # serial number of the node whose whisker it is
PLUG = "plug"  # of any model: what the contact filter needs
NO_CHANNEL = ("contact", "radius_mm", "t_s", NODE_COLUMN, DIRECTION_COLUMN, *MOTION_COLUMNS)
CANDIDATES = ("linear", "rational", "press")
MODELS = ("paper", *CANDIDATES, "default")


class Estimate(NamedTuple):
    """What a model says of one contact: mm, standard deviation, "tip" or "shaft", confidence 0..1; direction of the touch
    in degrees where the model knows directions. Numbers are never nan."""

    radius_mm: float
    sigma_mm: float
    type: str
    confidence: float
    direction_deg: float | None = None


class RadialModel(Known):
    """r = a1 f1 + a0 (equation 3), its standard error, and the radii it was fitted on."""

    def __init__(self, a1: float, a0: float, sigma_mm: float, low_mm: float, high_mm: float):
        self._line = ffi.new("struct nav_radial *", dict(zip(FIELDS, (a1, a0, sigma_mm, low_mm, high_mm), strict=True)))

    def __getattr__(self, name: str) -> float:
        if name in FIELDS:
            return getattr(self._line, name)
        raise AttributeError(name)

    @classmethod
    def fit(cls, peak_counts: np.ndarray, radius_mm: np.ndarray) -> RadialModel:
        """Least squares over contacts; ValueError when fewer than three are usable or all peaks are equal."""
        peaks = as_doubles(peak_counts, "peak_counts", (None,))
        radii = as_doubles(radius_mm, "radius_mm", peaks.shape)
        model = cls(0.0, 0.0, 0.0, 0.0, 0.0)
        given = doubles(peaks, "peak_counts", peaks.shape), doubles(radii, "radius_mm", peaks.shape)
        if lib.nav_radial_fit(model._line, *given, len(peaks)) < 0:
            raise ValueError(
                "radial fit: fewer than 3 usable contacts, or all peaks equal; record contacts at more radii"
            )
        return model

    peak = staticmethod(peak)

    def predict(self, peak_counts: float) -> tuple[float, float]:
        """(radius mm, sigma mm) of one contact."""
        return lib.nav_radial_predict(self._line, peak_counts), self._line.sigma_mm

    @property
    def content(self) -> dict:
        """What makes the same model again."""
        return {name: getattr(self, name) for name in FIELDS}

    @classmethod
    def of(cls, fields: Fields) -> RadialModel:
        """Makes a model from what `content` gave."""
        return cls(fields.number("a1"), fields.number("a0"), *radii_of(fields, "sigma_mm", "low_mm", "high_mm"))

    def save(self, path: str | Path) -> None:
        """Writes the model as JSON, for `load`."""
        save(self, path)

    @classmethod
    def load(cls, path: str | Path) -> RadialModel:
        """Read what `save` wrote; TableError with one line when it is something else."""
        model = load(path)
        if not isinstance(model, cls):
            raise not_a_model(path, ValueError(f"it is a {type(model).__name__}, not equation 3's line"))
        return model


@dataclass
class Whisks:
    """Recorded contacts of one whisker, in order of appearance."""

    contact: list[str]
    recorded: list[Contact]
    peak_counts: np.ndarray
    radius_mm: np.ndarray | None  # None when the file has no such column
    bad_rows: int  # rows with a cell that is no finite number: left out
    node: int | None = None  # serial number of the node whose whisker it is, where the file states it
    direction_deg: np.ndarray | None = None  # of the touch about the shaft, where the file states it

    def part(self, use: ArrayLike) -> Whisks:
        """Only the contacts of these indices."""
        arrays = (None if a is None else a[use] for a in (self.peak_counts, self.radius_mm))
        directions = None if self.direction_deg is None else self.direction_deg[use]
        named = [self.contact[n] for n in use], [self.recorded[n] for n in use]
        return Whisks(*named, *arrays, self.bad_rows, self.node, directions)


def read_whisks(path: str | Path, with_radius: bool, warn: Warn = ignore) -> Whisks:
    """Contacts of a calibration CSV; `with_radius`: the column radius_mm is required, else not even read, and contacts that
    cannot be learned from are left out. `warn(line)` is called with each fault that does not keep it from being read."""
    text = read_columns(path, ["contact", "t_s"] + (["radius_mm"] if with_radius else []))
    channels = [name for name in text if name not in NO_CHANNEL]
    if not channels:
        raise TableError(path, 1, "no channel column; add at least one, as in 'contact,radius_mm,t_s,x,y'")
    samples = np.column_stack([numbers(text[name]) for name in channels])
    t_s = numbers(text["t_s"])
    motion = {member: _motion(text, name) for name, member in MOTION_COLUMNS.items()}
    names = list(dict.fromkeys(text["contact"]))
    ids = np.array(text["contact"])
    rows = [np.flatnonzero(ids == name) for name in names]
    recorded = [
        Contact(t_s[r], samples[r], **{member: None if of is None else of[r] for member, of in motion.items()})
        for r in rows
    ]
    if not names:
        raise TableError(path, 2, "no rows; record contacts first")
    peaks = np.array([peak_of(samples[r]) for r in rows])
    radii = radii_of_contacts(path, names, numbers(text["radius_mm"]), rows) if with_radius else None
    bad = int((~np.isfinite(samples)).any(axis=1).sum())
    directions = _motion(text, DIRECTION_COLUMN)
    if directions is not None:
        directions = np.array([directions[r][0] for r in rows])
    whisks = Whisks(names, recorded, peaks, radii, bad, _node(path, text.get(NODE_COLUMN, [])), directions)
    unfit = faulty(path, channels, names, recorded, directions, warn)
    return whisks.part(np.flatnonzero(~unfit)) if with_radius else whisks


def _node(path, cells: list[str]) -> int | None:
    """The one serial number in a column; empty cells do not count."""
    found = sorted({cell for cell in cells if cell != ""})
    if len(found) > 1:
        raise TableError(
            path, None, f"contacts of nodes {found[0]} and {found[1]}; give each whisker a file of its own"
        )
    if found and not (found[0].isascii() and found[0].isdecimal()):
        raise TableError(path, None, f"node '{found[0]}' is no serial number")
    return int(found[0]) if found else None


def _motion(text: dict[str, list[str]], name: str) -> np.ndarray | None:
    """A column of motion; None where there is none or nothing in it. A direction may be 0 throughout."""
    values = numbers(text[name]) if name in text else np.zeros(0)
    known = np.isfinite(values) & ((values != 0.0) | (name == DIRECTION_COLUMN))
    return values if np.any(known) else None


class Fitted(NamedTuple):
    """A model with its RMS errors, mm, of contacts predicted by a model fitted without them: without their whole place, and
    without that contact alone; nan where too few remain. tried: the same two errors of every model that was tried."""

    model: RadialModel | CurveModel | PressModel
    place_mm: float
    contact_mm: float
    tried: dict[str, tuple[float, float]]


def fit(whisks: Whisks, name: str = "default") -> Fitted:
    """A model of the contacts by its name (MODELS); ValueError when they do not determine one.

    `default` is the model that predicts the contacts at left-out places best; of those whose error there is within a
    standard error of the best one's, the model that predicts left-out contacts best. The model belongs to the whisks' node, and
    holds their plug where they tell it.
    """
    model = _model_of(whisks, "linear" if name == "default" else name)
    if len(set(whisks.radius_mm.tolist())) == 1:
        at = f"radial fit: every contact is at {whisks.radius_mm[0]:g} mm"
        raise ValueError(f"{at}, and one radius gives no error estimate; record contacts at more radii")
    found = {}
    for one in CANDIDATES if name == "default" else (name,):
        try:
            made = model if one == name else _model_of(whisks, one)
            found[one] = made, *_left_out_errors(whisks, one, made)
        except ValueError:
            continue
    best = _best({one: np.nan_to_num(errors, nan=np.inf) for one, (_, *errors) in found.items()}, len(whisks.contact))
    found[best][0].node = whisks.node
    found[best][0].plug = Plug.fit(presses_of(whisks.recorded)[0], whisks.radius_mm)
    return Fitted(*found[best], {one: tuple(errors) for one, (_, *errors) in found.items()})


def _best(errors: dict[str, np.ndarray], contacts: int) -> str:
    """Compares models by the RMS errors of places and of contacts left out. The RMS of n errors has a relative standard error of (2 n)^-1/2."""
    least = min(place for place, _ in errors.values()) * (1.0 + 1.0 / np.sqrt(2.0 * contacts))
    return min((one for one in errors if errors[one][0] <= least), key=lambda one: tuple(errors[one][::-1]))


def _model_of(whisks: Whisks, name: str):
    if name in ("paper", "linear"):
        return RadialModel.fit(whisks.peak_counts, whisks.radius_mm)
    if name == "rational":
        return CurveModel.fit(whisks.peak_counts, whisks.radius_mm)
    return PressModel.fit(whisks.recorded, whisks.radius_mm, whisks.direction_deg)


def _left_out_errors(whisks: Whisks, name: str, model) -> tuple[float, float]:
    """RMS errors, mm, of places left out, but for the outermost, which ask for extrapolation, and of contacts left out."""
    if isinstance(model, PressModel):
        return model.place_mm, model.contact_mm
    places = [np.flatnonzero(whisks.radius_mm == place) for place in np.unique(whisks.radius_mm)[1:-1]]
    return tuple(_left_out(whisks, name, groups) for groups in (places, np.arange(len(whisks.contact))[:, None]))


def _left_out(whisks: Whisks, name: str, groups) -> float:
    off = []
    for out in groups:
        try:
            model = _model_of(whisks.part(np.setdiff1d(np.arange(len(whisks.contact)), out)), name)
        except ValueError:
            return float("nan")
        off += [estimate(model, whisks.recorded[n], whisks.peak_counts[n]).radius_mm - whisks.radius_mm[n] for n in out]
    return float(np.sqrt(np.mean(np.square(off)))) if off else float("nan")


def save(model: Any, path: str | Path) -> None:
    """Write a model of any kind as JSON."""
    formats = {RadialModel: FORMAT, CurveModel: CURVE_FORMAT, PressModel: PRESS_FORMAT}
    node = {} if model.node is None else {NODE_COLUMN: model.node}
    plug = {} if model.plug is None else {PLUG: model.plug.content}
    put(path, json.dumps({"format": formats[type(model)]} | node | model.content | plug, indent=1) + "\n")


def load(path: str | Path) -> RadialModel | CurveModel | PressModel:
    """Read what `save` wrote; TableError with one line when it is something else."""
    kinds = {
        FORMAT: RadialModel.of,
        CURVE_FORMAT: CurveModel.of,
        PRESS_FORMAT: PressModel.of,
    }
    try:
        fields = Fields(read_json(path))
        if fields.content.get("format") == GONE:
            raise ValueError(f"field 'format' is '{GONE}', of an earlier version")
        model = kinds[fields.text("format", *kinds)](fields)
        model.node = fields.whole(NODE_COLUMN, 0, NODE_MOST) if fields.has(NODE_COLUMN) else None
        model.plug = Plug.of(fields.part(PLUG)) if fields.has(PLUG) else None
        return model
    except ValueError as error:
        raise not_a_model(path, error) from error


def not_a_model(path: str | Path, error: ValueError) -> TableError:
    return TableError(path, None, f"no radial model: {error}; make one with 'whisker radial fit'")


def estimate(model: Any, contact: Contact, peak_counts: float | None = None) -> Estimate:
    """What a model of any kind says of one contact; `peak_counts`: equation 2, where it is known already."""
    if isinstance(model, PressModel) and contact.samples.shape[1] != model.axes:
        raise ValueError(f"{contact.samples.shape[1]} channels, but the model has {model.axes}")
    if isinstance(model, PressModel):
        found = model.predict(contact)
        return Estimate(found.radius_mm, found.sigma_mm, model.contact_type(found.radius_mm), *found[2:])
    counts = peak_of(contact.samples) if peak_counts is None else peak_counts
    mm, sigma_mm = model.predict(float(counts))
    if not np.isfinite(mm):
        middle, span = 0.5 * (model.low_mm + model.high_mm), model.high_mm - model.low_mm
        return Estimate(middle, span, "shaft", 0.0)
    beyond = max(0.0, model.low_mm - mm, mm - model.high_mm) / max(sigma_mm, TIP_MM)
    return Estimate(mm, sigma_mm, model.contact_type(mm), float(np.exp(-0.5 * max(0.0, beyond - 2.0) ** 2)))
