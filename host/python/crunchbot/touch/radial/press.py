"""Radial distance from how a press grows: a regression at several depths of the press, so that it answers before its end.

At each depth, ln radius is linear in ln f, (ln f)^2 and the shape of the press so far: f is the length of the deflection
over the channels, the shape is its direction and its length at a quarter and half of the depth. A conical whisker gives
f as a rational function of the radius (whisker_physics section 4), which is close to a power law over a whisker's outer
two thirds. Ridge regression, its strength chosen by the places left out; so is the standard deviation. A whole contact
that is unlike those calibrated, as one that slips late, is answered by that rational function of its peak.
"""

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...fields import Fields
from ...native import as_doubles
from .curve import CurveModel, Known, peak_of
from .push import (
    AXES_MOST,
    LEAST,
    ONSET_SHARE,
    RADIUS_MOST_MM,
    UNITS,
    Contact,
    Press,
    advance_of,
    press_of,
    presses_of,
    reach_of,
)

STAGES = 16  # depths at which there is a regression, denser at the start
STAGE_POWER = 1.5
WINDOW = 0.1  # of a depth: samples over which a deflection is a mean
RIDGES = (0.1, 1.0, 10.0, 100.0, 1000.0)  # of the features but ln f
SMOOTH_RIDGES = (0.1, 1.0, 10.0, 1e6)  # of the Gaussians over ln f: from close to the places to none
FREE_RIDGE = 1e-6  # of constant, ln f and its square
CENTRES = 8
LEAST_PLACES, LEAST_CONTACTS = 4, 8
DEEPEST_SHARE = 0.98  # of the shortest push in calibration: the last depth
RADIUS_SLACK = 0.15  # radii beyond the calibrated ones that are answered, as a share
USUAL = 3.5  # standard deviations of a feature that are nothing unusual
DIRECTIONS_MOST = 72


def features_of(press: Press, depth: float) -> np.ndarray | None:
    """(ln f, direction over the channels, ln of f at a quarter and half of the depth over f); None: not as deep yet."""
    if press.steady < depth:
        return None
    here, half, quarter = (_deflection(press, share * depth) for share in (1.0, 0.5, 0.25))
    size = float(np.linalg.norm(here))
    if not size > 0.0:
        return None
    shares = [math.log(max(float(np.linalg.norm(part)), 1e-3 * size) / size) for part in (half, quarter)]
    return np.array([math.log(size), *(here / size), *shares])


def _deflection(press: Press, depth: float) -> np.ndarray:
    """Mean deflection (channels,) over the last of this depth."""
    first, last = np.searchsorted(press.depth, [(1.0 - WINDOW) * depth, depth])
    return press.deflection[min(first, last) : last + 1].mean(axis=0)


@dataclass
class Stage:
    """A regression at one depth. features: those of `features_of`; columns: those of `_rows`."""

    depth: float
    mean: np.ndarray  # (features,) in calibration
    scale: np.ndarray  # (features,) standard deviations in calibration
    span: np.ndarray  # (2,) least and largest ln f in calibration, in standard deviations about their mean
    weights: np.ndarray  # (columns,)
    inverse: np.ndarray  # (columns, columns) of the regression's normal matrix: leverage of a new press
    sigma: float  # standard deviation of ln radius at no leverage

    NAMES = ("depth", "mean", "scale", "span", "weights", "inverse", "sigma")

    @classmethod
    def fit(cls, depth: float, features: np.ndarray, radius_mm: np.ndarray) -> "tuple[Stage, np.ndarray, np.ndarray]":
        """Ridge regression of ln radius, and the errors, mm, of places left out and of contacts left out (n,)."""
        mean, scale = features.mean(axis=0), features.std(axis=0) + 1e-9
        first = (features[:, 0] - mean[0]) / scale[0]
        stage = cls(depth, mean, scale, np.array([first.min(), first.max()]), np.zeros(0), np.zeros(0), 0.0)
        rows, target = stage._rows(features), np.log(radius_mm)
        groups = [radius_mm == place for place in np.unique(radius_mm)], np.eye(len(target), dtype=bool)
        found = []
        for ridge, smooth in itertools.product(RIDGES, SMOOTH_RIDGES):
            held = np.array([FREE_RIDGE] * 3 + [ridge] * (features.shape[1] - 1) + [smooth] * CENTRES)
            off, standard = zip(*(_left_out(rows, target, held, part) for part in groups), strict=True)
            sigma = math.sqrt(float(np.mean(np.square(standard))))
            spread = np.abs(np.array(off)) / np.maximum(np.abs(standard), 1e-300) * sigma
            found.append((float(np.log(spread).sum()), sigma, held, off))
        _, stage.sigma, held, off = min(found, key=lambda one: one[0])
        stage.weights, stage.inverse = _ridge(rows, target, held)
        places, contacts = (np.exp(target - part) - radius_mm for part in off)
        return stage, places, contacts

    def _rows(self, features: np.ndarray) -> np.ndarray:
        """Columns of the regression (n, columns): constant, squared ln f, the features, and Gaussians over ln f."""
        z = (np.atleast_2d(features) - self.mean) / self.scale
        centres = np.linspace(*self.span, CENTRES)
        gaussians = np.exp(-0.5 * ((z[:, :1] - centres) / (centres[1] - centres[0] + 1e-9)) ** 2)
        return np.column_stack([np.ones(len(z)), z[:, 0] ** 2, z, gaussians])

    @classmethod
    def of(cls, fields: Fields, axes: int) -> "Stage":
        """Makes a model from what PressModel.content gave."""
        features = 1 + axes + 2
        columns = 2 + features + CENTRES
        shapes = {"mean": (features,), "scale": (features,), "span": (2,), "weights": (columns,)}
        arrays = {
            name: as_doubles(fields.array(name, len(shape)), f"field '{name}'", shape)
            for name, shape in (shapes | {"inverse": (columns, columns)}).items()
        }
        fields.array("scale", 1, LEAST)
        return cls(depth=fields.number("depth", LEAST), sigma=fields.number("sigma", 0.0), **arrays)

    def predict(self, features: np.ndarray) -> tuple[float, float, float, float]:
        """ln radius, its standard deviation, log-likelihood of the shape among those calibrated, largest departure of a
        feature from calibration in standard deviations."""
        row = self._rows(features)[0]
        z = (features - self.mean) / self.scale
        near = -0.5 * float(z[1:] @ z[1:]) - float(np.log(self.scale[1:]).sum())
        leverage = max(0.0, float(row @ self.inverse @ row))
        return float(row @ self.weights), self.sigma * math.sqrt(1.0 + leverage), near, float(np.abs(z).max())


def _left_out(rows: np.ndarray, target: np.ndarray, held: np.ndarray, groups) -> tuple[np.ndarray, np.ndarray]:
    """Errors (n,) of each group predicted without it, and the same over the root of 1 + leverage."""
    off, standard = np.empty(len(target)), np.empty(len(target))
    for out in groups:
        weights, inverse = _ridge(rows[~out], target[~out], held)
        off[out] = target[out] - rows[out] @ weights
        standard[out] = off[out] / np.sqrt(1.0 + np.sum(rows[out] @ inverse * rows[out], axis=1))
    return off, standard


def _ridge(rows: np.ndarray, target: np.ndarray, held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(weights, inverse of the normal matrix)."""
    inverse = np.linalg.inv(rows.T @ rows + np.diag(held))
    return inverse @ (rows.T @ target), inverse


class Estimate(NamedTuple):
    """Radius and its standard deviation, mm; confidence 0..1 that the press is like those calibrated; direction of the
    touch, degrees, where the model knows directions."""

    radius_mm: float
    sigma_mm: float
    confidence: float
    direction_deg: float | None


class PressModel(Known):
    """Stages by direction of the touch: one direction, None, where calibration names none; and what answers where they
    doubt."""

    DOUBTED = 0.5  # confidence below which a press is more likely unlike those calibrated than like them
    NUMBERS = ("window", "low_mm", "high_mm", "place_mm", "contact_mm")

    def __init__(
        self,
        unit: str,
        axes: int,
        numbers: dict[str, float],
        stages: dict[float | None, list[Stage]],
        curve: CurveModel,
    ):
        """unit: of depths. window: advance over which onsets are looked for. place_mm, contact_mm: RMS errors at the last
        depth of contacts predicted without their place, and without themselves; low_mm, high_mm: radii calibrated."""
        self.unit, self.axes, self.stages, self.curve = unit, axes, stages, curve
        self.window, self.low_mm, self.high_mm, self.place_mm, self.contact_mm = (numbers[n] for n in self.NUMBERS)
        self.sigma_mm = self.place_mm

    @classmethod
    def fit(
        cls, contacts: list[Contact], radius_mm: np.ndarray, direction_deg: np.ndarray | None = None
    ) -> "PressModel":
        """Fits a model to contacts at known radii (n,) mm, and directions (n,) degrees where known; ValueError when too few."""
        radii = np.asarray(radius_mm, np.float64)
        directions = np.full(len(radii), np.nan) if direction_deg is None else np.asarray(direction_deg, np.float64)
        presses, window = presses_of(contacts)
        use = np.array([n for n, press in enumerate(presses) if press is not None and radii[n] > 0.0], int)
        units, places = {presses[n].unit for n in use}, len(np.unique(radii[use]))
        if len(use) < LEAST_CONTACTS or places < LEAST_PLACES or len(units) != 1:
            raise ValueError(
                f"radial fit: {len(use)} of {len(radii)} contacts show a push, at {places} radii; at least "
                f"{LEAST_CONTACTS}, at {LEAST_PLACES} radii or more, all with the same column of motion, are needed"
            )
        grown = np.array([presses[n].steady for n in use])
        deepest = DEEPEST_SHARE * min(float(np.median(grown[radii[use] == place])) for place in np.unique(radii[use]))
        stages, errors = {}, []
        for direction in np.unique(directions[use]):  # equal NaNs count as one
            mine = [n for n in use if directions[n] == direction or np.isnan(direction)]
            known = None if np.isnan(direction) else float(direction)
            stages[known], *off = _stages_of([presses[n] for n in mine], radii[mine], window, deepest)
            errors.append(off)
        place_mm, contact_mm = (float(np.sqrt(np.mean(np.concatenate(off) ** 2))) for off in zip(*errors, strict=True))
        numbers = (window, float(radii[use].min()), float(radii[use].max()), place_mm, contact_mm)
        curve = CurveModel.fit(np.array([peak_of(contact.samples) for contact in contacts]), radii)
        return cls(
            units.pop(), contacts[0].samples.shape[1], dict(zip(cls.NUMBERS, numbers, strict=True)), stages, curve
        )

    def predict(self, contact: Contact) -> Estimate:
        """The radius of a press, whole or so far; of a whole one that is doubted, by the curve and with its deviation."""
        if advance_of(contact)[1] != self.unit:
            columns = " or ".join(name for name, unit in UNITS.items() if unit == self.unit and name)
            raise ValueError(f"the model is of pushes in {self.unit}; give the column {columns or 't_s alone'}")
        grown = self._grown(contact)
        if grown.confidence >= self.DOUBTED or not self._whole(contact):
            return grown
        mm, sigma_mm = self.curve.predict(peak_of(contact.samples))
        return grown._replace(radius_mm=mm, sigma_mm=sigma_mm) if self.curve.knows(mm) else grown

    def _whole(self, contact: Contact) -> bool:
        """Whether a contact has advanced as far as those calibrated: only then do peaks compare."""
        return DEEPEST_SHARE * self.window <= ONSET_SHARE * reach_of(contact) < math.inf

    def _grown(self, contact: Contact) -> Estimate:
        """By the stages. Before the first depth: the middle of the radii, and no confidence."""
        press = press_of(contact, self.window)
        found = [] if press is None else [one for stages in self.stages.values() if (one := _answer(stages, press))]
        if not found:
            return Estimate(0.5 * (self.low_mm + self.high_mm), self.high_mm - self.low_mm, 0.0, None)
        log_mm, sigma, near, worst = (np.array(column) for column in zip(*found, strict=True))
        share = np.exp(near - near.max())
        share /= share.sum()
        low, high = self.low_mm * (1.0 - RADIUS_SLACK), self.high_mm * (1.0 + RADIUS_SLACK)
        mm = np.clip(np.exp(np.clip(log_mm, 0.0, math.log(high))), low, high)
        best = int(np.argmax(share))
        confidence = math.exp(-0.5 * max(0.0, float(worst[best]) - USUAL) ** 2)
        mean = float(share @ mm)
        # What is unlike every calibrated press may be at any of the radii.
        anywhere = (1.0 - confidence) * (self.high_mm - self.low_mm) ** 2 / 12.0
        sigma_mm = math.sqrt(float(share @ ((mm * sigma) ** 2 + (mm - mean) ** 2)) + anywhere)
        return Estimate(mean, sigma_mm, confidence, list(self.stages)[best])

    @property
    def content(self) -> dict:
        """What makes the same model again."""
        stages = [
            {"direction_deg": direction} | {name: _plain(getattr(stage, name)) for name in Stage.NAMES}
            for direction, members in self.stages.items()
            for stage in members
        ]
        numbers = {n: getattr(self, n) for n in self.NUMBERS}
        return {"unit": self.unit, "axes": self.axes} | numbers | {"stages": stages, "curve": self.curve.content}

    @classmethod
    def of(cls, fields: Fields) -> "PressModel":
        """Makes a model from what `content` gave; ValueError names the field that is wrong."""
        axes = fields.whole("axes", 1, AXES_MOST)
        numbers = {name: fields.number(name, 0.0, RADIUS_MOST_MM) for name in cls.NUMBERS}
        fields.number("low_mm", LEAST, numbers["high_mm"])
        stages: dict[float | None, list[Stage]] = {}
        for part in fields.parts("stages", STAGES * DIRECTIONS_MOST):
            direction = part.number("direction_deg", -360.0, 360.0) if part.has("direction_deg") else None
            stages.setdefault(direction, []).append(Stage.of(part, axes))
        return cls(fields.text("unit", *UNITS.values()), axes, numbers, stages, CurveModel.of(fields.part("curve")))


def _plain(value):
    return value.tolist() if isinstance(value, np.ndarray) else value


def _answer(stages: list[Stage], press: Press) -> tuple[float, float, float, float] | None:
    """What the deepest stage that the press has reached predicts; None before the first."""
    for stage in reversed(stages):
        features = features_of(press, stage.depth)
        if features is not None:
            return stage.predict(features)
    return None


def _stages_of(presses: list[Press], radii: np.ndarray, window: float, deepest: float) -> tuple:
    """Stages of one direction, and the last one's errors, mm, of places and of contacts left out; the outermost places ask
    for extrapolation and are not among the former. An onset is not known before the press is deeper than the window."""
    found = []
    for k in range(1, STAGES + 1):
        depth = deepest * (k / STAGES) ** STAGE_POWER
        if depth < window:
            continue
        features = [features_of(press, depth) for press in presses]
        use = [n for n, one in enumerate(features) if one is not None]
        if len(use) >= LEAST_CONTACTS and len(np.unique(radii[use])) >= LEAST_PLACES:
            found.append((*Stage.fit(depth, np.array([features[n] for n in use]), radii[use]), radii[use]))
    if not found:
        raise ValueError("radial fit: the pushes are too short or too few at one direction; record more")
    _, places, contacts, radii = found[-1]
    inner = (radii > radii.min()) & (radii < radii.max())
    return [stage for stage, *_ in found], places[inner], contacts
