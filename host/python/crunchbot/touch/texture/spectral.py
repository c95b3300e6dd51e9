"""Floor texture, the default method: spectral classifiers of a window, its half and its quarter, from recordings to calibrated decisions."""

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...fields import Fields
from ...native import as_doubles, doubles, ffi, lib
from ...outputs import put
from ...tables import TableError
from .classifier import Classifier
from .novelty import Novelty

FORMAT = "whisker texture model 10"
SENSOR_STOPS = (0.0, 65535.0)  # of raw counts, 16 bits
NO_NOVELTY = "surfaces never trained, by windows in a row; give two recordings or more of each surface, a window long"
LIMITS = ("spike", "still", "low", "high")
SURE = 0.95  # probability at which a sequential decision stops
LOOKS = 4  # of a sequential decision in a window
HAZARD_LEAST, HAZARD = 1e-6, 0.02  # changes of surface per window: tiles of 0.5 m at 0.1 m/s, windows of 100 ms
LENGTH_MOST = 1 << 20  # samples of a window
SPEED_MOST, FARTHEST = 1e3, 1e9  # m/s; of a pass, over the limit: more is no model
RANGES = {
    "rate_hz": (1e-3, 1e9),
    "window_ms": (1e-3, 1e6),
    "doubt": (0.0, 1.0),
    "hazard": (HAZARD_LEAST, 1.0),
}


@dataclass
class Judgement:
    """What one window says, with what it rests on."""

    end: int  # one past its last sample
    samples: int
    label: int  # class, or -1
    best: int  # the likeliest class, whatever the label
    confidence: float  # its probability, given all samples since the stream began
    novelty: float  # distance from all trained surfaces over its limit: above 1 the label is -1
    bad: int
    loglik: np.ndarray  # (classes,) of these samples alone


@dataclass
class SpectralModel:
    """One model for all whiskers of a kind: classifiers by window length, and what the training recordings were like."""

    classes: list[str]
    rate_hz: float
    classifiers: list[Classifier]
    limits: dict[str, np.ndarray]  # spike, still, low, high: (channels,)
    window_ms: float = 100.0
    doubt: float = 0.0  # probability of a class below which the answer is "unknown"
    hazard: float = HAZARD  # changes of surface in window_ms
    novelty: Novelty | None = None
    speed_m_s: tuple[float, float] | None = None  # least and most of the recordings; None: not known
    passes: dict[str, np.ndarray] = field(
        default_factory=dict
    )  # by class, of each place held out: mean novelty of a pass
    columns: list[str] = field(default_factory=list)  # names of the channels; empty: not known
    figures: dict = field(default_factory=dict)  # of held-out recordings, for the reader

    @property
    def channels(self) -> int:
        return len(self.classifiers[0].floor)

    def not_learned(self) -> list[str]:
        """What there was too little data to learn, a line each."""
        return [NO_NOVELTY] if self.novelty is None else []

    def stream(self, window: int, step: int = 0, patience: int = 0) -> "Stream":
        """Decisions in windows of so many samples, or, with a step, sequential ones within `patience` samples."""
        return Stream(self, window, step, patience)

    def judge(self, samples: np.ndarray, window: int, sequential: bool = False) -> list[Judgement]:
        """All decisions on samples (n, channels). Sequential: looks four times a window, for up to four windows."""
        step = min(max(self.classifiers[0].length, window // LOOKS), window) if sequential else 0
        return self.stream(window, step, 4 * window if sequential else 0).push(samples)

    def save(self, path: str | Path) -> None:
        content = {"format": FORMAT, "classes": self.classes, "rate_hz": self.rate_hz, "window_ms": self.window_ms}
        content |= {name: getattr(self, name) for name in ("doubt", "hazard", "speed_m_s", "columns", "figures")}
        content["limits"] = {name: _listed(self.limits[name]) for name in LIMITS}
        content["passes"] = {name: _listed(self.passes[name]) for name in self.passes}
        content["novelty"] = None if self.novelty is None else _fields(self.novelty)
        content["classifiers"] = [_fields(r) | {"span": _listed(r.span)} for r in self.classifiers]
        put(path, json.dumps(content) + "\n")

    def check(self) -> None:
        """ValueError when parts of the model differ in size."""
        if any(len(c.bias) != len(self.classes) for c in self.classifiers):
            raise ValueError("classifiers and classes differ")
        if self.novelty is not None and self.novelty.length not in {c.length for c in self.classifiers}:
            raise ValueError("novelty: no classifier has its length")
        by_channel = [*self.limits.values(), *(part for c in self.classifiers for part in (c.floor, c.span))]
        if len(set(map(len, by_channel))) != 1:
            raise ValueError("limits and classifiers differ in channels")

    @classmethod
    def from_json(cls, path: str | Path, content: object) -> "SpectralModel":
        """What `save` wrote; TableError with one line when it is something else."""
        try:
            return cls._of(Fields(content))
        except (ValueError, OverflowError) as error:
            raise no_model(path, error) from error

    @classmethod
    def _of(cls, fields: Fields) -> "SpectralModel":
        classes = fields.names("classes", lib.NAV_TEXTURE_CLASSES_MAX)
        classifiers = [_classifier(part) for part in fields.parts("classifiers", lib.NAV_TEXTURE_CLASSIFIERS_MAX)]
        limits = {name: fields.part("limits").array(name, 1) for name in LIMITS}
        numbers = {name: fields.number(name, *RANGES[name]) for name in RANGES}
        novelty = _novelty(fields.part("novelty")) if fields.has("novelty") else None
        fields.part("figures")
        columns = fields.names("columns", lib.NAV_TEXTURE_CHANNELS_MAX) if fields.take("columns") else []
        speed = fields.numbers("speed_m_s", 2, 0.0, SPEED_MOST) if fields.has("speed_m_s") else None
        passes = fields.part("passes") if fields.has("passes") else Fields({})
        model = cls(
            classes,
            speed_m_s=speed,
            classifiers=classifiers,
            limits=limits,
            figures=fields.take("figures"),
            columns=columns,
            novelty=novelty,
            passes={c: passes.array(c, 1, 0.0, FARTHEST) for c in classes if passes.has(c)},
            **numbers,
        )
        model.check()
        model.stream(2)
        return model


def no_model(path: str | Path, error: Exception) -> TableError:
    return TableError(path, None, f"no texture model: {error}; make one with 'whisker texture train'")


def _classifier(fields: Fields) -> Classifier:
    flat = {name: fields.array(name, 1) for name in ("floor", "shape", "bias", "span")}
    length, behind = fields.whole("length", 1, LENGTH_MOST), fields.number("behind", 0.0, 1.0)
    return Classifier(length=length, behind=behind, weight=fields.array("weight", 2), **flat)


def _novelty(fields: Fields) -> Novelty:
    arrays = {name: fields.array(name, dimensions) for name, dimensions in Novelty.ARRAYS.items()}
    return Novelty(length=fields.whole("length", 1, LENGTH_MOST), **arrays)


class Stream:
    """Decisions sample by sample; nothing is allocated in C after this."""

    def __init__(self, model: SpectralModel, window: int, step: int, patience: int):
        self._classes, self._channels, self._taken = len(model.classes), model.channels, 0
        self._novelty = ffi.NULL if model.novelty is None else model.novelty.native()  # lent, as are the classifiers
        self._classifiers = model.classifiers
        natives = ffi.new("struct nav_texture_classifier *[]", [c.native for c in model.classifiers])
        rules = {
            "channels": self._channels,
            "classes": self._classes,
            "classifiers": len(natives),
            "classifier": natives,
        }
        rules |= {"window": window, "step": step, "patience": patience, "sure": SURE}
        rules["novelty"] = self._novelty
        rules["doubt"] = model.doubt
        rules["hazard"] = 1000.0 * model.hazard / (model.window_ms * model.rate_hz)
        if model.novelty is not None:
            rules["novelty_classifier"] = [c.length for c in model.classifiers].index(model.novelty.length)
        limits = self._limits(model, patience if step else window)
        given = {name: doubles(values, name, (model.channels,)) for name, values in limits.items()}
        rules["limits"] = {"channels": model.channels} | given
        made = lib.nav_texture_stream_new(ffi.new("struct nav_texture_rules *", rules))
        if made == ffi.NULL:
            raise ValueError(f"texture: no stream of windows of {window} samples")
        self._stream = ffi.gc(made, lib.nav_texture_stream_free)
        self._decision, self._decided = ffi.new("struct nav_texture_decision *"), ffi.new("int *")
        self._loglik = np.zeros(self._classes)

    @staticmethod
    def _limits(model: SpectralModel, longest: int) -> dict[str, np.ndarray]:
        """The limits, with the span of the first classifier whose windows are as long as those judged, else of the longest."""
        span = next((c.span for c in model.classifiers if c.length >= longest), model.classifiers[-1].span)
        return {n: as_doubles(v, n, (model.channels,)) for n, v in (model.limits | {"span": span}).items()}

    def push(self, samples: np.ndarray) -> list[Judgement]:
        """Take samples (n, channels) of raw counts, nan where missing; the decisions that they complete."""
        samples = as_doubles(samples, "samples", (None, self._channels))
        found, at, start = [], 0, doubles(samples, "samples", samples.shape)
        loglik = doubles(self._loglik, "loglik", (self._classes,))
        while at < len(samples):
            rest = start + at * self._channels
            at += lib.nav_texture_stream_push(
                self._stream, rest, len(samples) - at, self._decided, self._decision, loglik
            )
            if self._decided[0]:
                found.append(self._judgement(self._taken + at))
        self._taken += len(samples)
        return found

    def reset(self) -> None:
        """Forget the samples held and what came before them: the next are no continuation."""
        lib.nav_texture_stream_reset(self._stream)

    def _judgement(self, end: int) -> Judgement:
        d = self._decision
        return Judgement(end, d.samples, d.label, d.best, d.confidence, d.novelty, d.health.bad, self._loglik.copy())


def forward(loglik: np.ndarray, temper: float, chance: float) -> np.ndarray:
    """The posterior after each of some windows in a row: log-likelihoods (m, classes) -> (m, classes).

    Before each the surface changes with this chance; evidence of all but the first counts `temper` times."""
    loglik = as_doubles(loglik, "loglik", (None, None))
    posterior = np.empty_like(loglik)
    given = doubles(loglik, "loglik", loglik.shape), *loglik.shape
    lib.nav_texture_filter_run(*given, temper, chance, doubles(posterior, "posterior", loglik.shape))
    return posterior


def _fields(part: Classifier | Novelty) -> dict:
    return {n: getattr(part, n) for n in part.NUMBERS} | {n: _listed(getattr(part, n)) for n in part.ARRAYS}


def _listed(array: np.ndarray) -> list:
    """Numbers with eight significant digits: enough for any decision, and short."""
    flat = [float(f"{v:.8g}") for v in np.ravel(array)]
    return np.reshape(flat, np.shape(array)).tolist()
