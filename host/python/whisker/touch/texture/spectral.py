"""Floor texture, the default method: a ladder of spectral classifiers, from recordings to calibrated decisions."""

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...native import as_doubles, doubles, ffi, lib
from ...tables import TableError
from .change import Change
from .rung import Rung
from .settle import Settle
from .strange import Strange

FORMAT = "whisker texture model 6"
PARTS = {"change": Change, "strange": Strange, "settle": Settle}  # of windows in a row
LIMITS = ("spike", "still", "low", "high")


@dataclass
class Judgement:
    """What one window says, with what it rests on."""

    end: int  # one past its last sample
    samples: int
    label: int  # class, or -1
    confidence: float
    border: bool
    distance: float
    bad: int
    loglik: np.ndarray  # (classes,)
    notice: bool = False  # no window, but word of a border at once


@dataclass
class SpectralModel:
    """One model for all whiskers of a kind: rungs by window length, and what the training recordings were like."""

    classes: list[str]
    rate_hz: float
    rungs: list[Rung]
    limits: dict[str, np.ndarray]  # spike, still, low, high: (channels,)
    window_ms: float = 100.0
    growth: float = 0.5
    together: float = 1.0
    doubt: float = 0.0
    sure: float = 0.99
    change: Change | None = None
    strange: Strange | None = None
    settle: Settle | None = None
    figures: dict = field(default_factory=dict)  # of held-out recordings, for the reader

    @property
    def channels(self) -> int:
        return len(self.rungs[0].floor)

    def stream(self, window: int, step: int = 0, patience: int = 0) -> "Stream":
        """Decisions in windows of so many samples, or, with a step, sequential ones within `patience` samples."""
        return Stream(self, window, step, patience)

    def judge(
        self, samples: np.ndarray, window: int, sequential: bool = False, notices: bool = False
    ) -> list[Judgement]:
        """All decisions on samples (n, channels), with notices of borders between them only if asked for. Sequential: looks
        at every shortest rung, up to four windows."""
        step = min(self.rungs[0].length, window) if sequential else 0
        found = self.stream(window, step, 4 * window if sequential else 0).push(samples)
        return [d for d in found if notices or not d.notice]

    def save(self, path) -> None:
        content = {"format": FORMAT, "classes": self.classes, "rate_hz": self.rate_hz, "window_ms": self.window_ms}
        content |= {
            "growth": self.growth,
            "together": self.together,
            "doubt": self.doubt,
            "sure": self.sure,
            "figures": self.figures,
        }
        content["limits"] = {name: _listed(self.limits[name]) for name in LIMITS}
        for name in PARTS:
            part = getattr(self, name)
            content[name] = None if part is None else _fields(part)
        content["rungs"] = [_fields(r) | {"span": _listed(r.span)} for r in self.rungs]
        Path(path).write_text(json.dumps(content) + "\n")

    @classmethod
    def from_json(cls, path, content: dict) -> "SpectralModel":
        """What `save` wrote; TableError with one line when it is something else."""
        try:
            return cls._parsed(content)
        except (ValueError, KeyError, TypeError, IndexError, AttributeError, OverflowError) as error:
            text = f"not a texture model ({error!r}); make one with 'whisker texture train'"
            raise TableError(path, None, text) from error

    @classmethod
    def _parsed(cls, content: dict) -> "SpectralModel":
        rungs = []
        for part in content["rungs"]:
            arrays = {name: np.array(part[name], dtype=np.float64) for name in (*Rung.ARRAYS, "span")}
            arrays["axis"] = arrays["axis"].reshape(-1, len(arrays["centre"]))
            arrays["axis_weight"] = arrays["axis_weight"].reshape(len(arrays["bias"]), -1)
            rungs.append(Rung(**{name: part[name] for name in Rung.NUMBERS}, **arrays))
        limits = {name: np.array(content["limits"][name], dtype=np.float64) for name in LIMITS}
        numbers = {
            name: float(content[name]) for name in ("rate_hz", "window_ms", "growth", "together", "doubt", "sure")
        }
        model = cls([str(c) for c in content["classes"]], rungs=rungs, limits=limits, **numbers)
        for name, kind in PARTS.items():
            if content[name] is not None:
                arrays = {n: np.array(content[name][n], dtype=np.float64) for n in kind.ARRAYS}
                setattr(model, name, kind(**{n: content[name][n] for n in kind.NUMBERS}, **arrays))
        model.figures = content.get("figures", {})
        if not rungs or any(len(r.bias) != len(model.classes) for r in rungs):
            raise ValueError("rungs and classes differ")
        if len({len(part) for part in (*limits.values(), *(r.floor for r in rungs), *(r.span for r in rungs))}) != 1:
            raise ValueError("limits and rungs differ in channels")
        if not all(np.isfinite(v) for v in (*numbers.values(), *(x for r in rungs for x in (r.unknown, r.border)))):
            raise ValueError("a number is not finite")
        model.stream(2)
        return model


class Stream:
    """Decisions sample by sample; nothing is allocated in C after this."""

    def __init__(self, model: SpectralModel, window: int, step: int, patience: int):
        self._classes, self._channels, self._taken = len(model.classes), model.channels, 0
        rules = ffi.new("struct nav_texture_rules *")
        rules.channels, rules.classes, rules.window, rules.rungs = (
            model.channels,
            self._classes,
            window,
            len(model.rungs),
        )
        natives = ffi.new("struct nav_texture_rung *[]", [r.native for r in model.rungs])
        unknown, border = (np.array([getattr(r, n) for r in model.rungs], float) for n in ("unknown", "border"))
        each = (len(model.rungs),)
        rules.rung, rules.unknown, rules.border = (
            natives,
            doubles(unknown, "unknown", each),
            doubles(border, "border", each),
        )
        rules.growth, rules.together, rules.doubt, rules.sure = model.growth, model.together, model.doubt, model.sure
        rules.step, rules.patience = step, patience
        self._parts = {
            name: ffi.NULL if step else _native(getattr(model, name)) for name in PARTS
        }  # lent to the stream
        for name, part in self._parts.items():
            setattr(rules, name, part)
        # The span of windows at least as long as those judged; the longest rung's if there is none.
        longest = patience if step else window
        span = next((r.span for r in model.rungs if r.length >= longest), model.rungs[-1].span)
        shape = (model.channels,)
        limits = {n: as_doubles(v, n, shape) for n, v in (model.limits | {"span": span}).items()}
        rules.limits.channels = model.channels
        for name, values in limits.items():
            setattr(rules.limits, name, doubles(values, name, shape))
        made = lib.nav_texture_stream_new(rules)
        if made == ffi.NULL:
            raise ValueError(f"texture: no stream of windows of {window} samples")
        self._rungs = model.rungs  # lent to the stream
        self._stream = ffi.gc(made, lib.nav_texture_stream_free)
        self._decision, self._decided = ffi.new("struct nav_texture_decision *"), ffi.new("int *")
        self._loglik = np.zeros(self._classes)

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
        border = bool(d.border)
        return Judgement(
            end, d.samples, d.label, d.confidence, border, d.distance, d.health.bad, self._loglik.copy(), bool(d.notice)
        )


def _native(part: Change | Strange | Settle | None):
    return ffi.NULL if part is None else part.native()


def _fields(part: Rung | Change | Strange | Settle) -> dict:
    return {n: getattr(part, n) for n in part.NUMBERS} | {n: _listed(getattr(part, n)) for n in part.ARRAYS}


def _listed(array: np.ndarray) -> list:
    """Numbers with six significant digits: enough for any decision, and short."""
    flat = [float(f"{v:.6g}") for v in np.ravel(array)]
    return np.reshape(flat, np.shape(array)).tolist()
