"""Floor texture: the stationary naive Bayes classifier (paper, equation 1) with its training, files and recordings."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .native import doubles, ffi, lib
from .tables import TableError, numbers, read_columns

FORMAT = "whisker texture model 1"
BINS = 64
PSEUDO = 1.0  # Laplace: one sample more in every bin
TAIL = 0.0005  # share of the training samples on each side that the range leaves to the end bins
TEMPER = 0.05  # 200 samples of 100 ms are worth 2-20 independent ones (whisker_physics section 7)


class TextureModel:
    """One whisker's model: class names in order, rest and bins by axis, log P(x|T) by class, axis and bin."""

    def __init__(self, classes: list[str], rest, low, high, table: np.ndarray | None = None, bins: int = BINS):
        """rest, low, high: one number per axis, counts (low and high relative to rest); table (classes, axes, bins)."""
        self.classes = list(classes)
        self.rest = np.atleast_1d(np.asarray(rest, dtype=np.float64))
        self.low = np.ascontiguousarray(low, dtype=np.float64)
        self.high = np.ascontiguousarray(high, dtype=np.float64)
        shape = (len(self.classes), len(self.low), bins if table is None else table.shape[2])
        made = lib.nav_texture_new(*shape, doubles(self.low), doubles(self.high))
        if made == ffi.NULL:
            raise ValueError(f"texture model: impossible shape {shape} or range; every range needs low < high")
        self._model = ffi.gc(made, lib.nav_texture_free)
        size = 8 * int(np.prod(shape))
        self.table = np.frombuffer(ffi.buffer(lib.nav_texture_table(made), size)).reshape(shape)
        if table is not None:
            self.table[:] = table

    @classmethod
    def train(cls, recordings: dict[str, list[np.ndarray]], rest=None, bins: int = BINS) -> "TextureModel":
        """Learn from raw counts, arrays (n, axes) by class. `rest`: by axis; default the median of all training data."""
        everything = np.concatenate([_counts(r) for group in recordings.values() for r in group])
        everything = everything[np.isfinite(everything).all(axis=1)]
        if len(everything) == 0:
            raise ValueError("texture training: no finite sample; record each surface for some seconds")
        rest = np.median(everything, axis=0) if rest is None else np.broadcast_to(rest, everything.shape[1:])
        low, high = _ranges(everything - rest, bins)
        model = cls(list(recordings), rest, low, high, bins=bins)
        for index, group in enumerate(recordings.values()):
            for recording in group:
                samples = np.ascontiguousarray(_counts(recording) - rest)
                lib.nav_texture_add(model._model, index, doubles(samples), len(samples))
        lib.nav_texture_finish(model._model, PSEUDO)
        return model

    def loglik(self, window: np.ndarray, rest=None) -> np.ndarray:
        """Equation 1: log-likelihood of the window (n, axes) of raw counts by class. `rest`: default the model's."""
        samples = np.ascontiguousarray(_counts(window) - (self.rest if rest is None else rest))
        if samples.shape[1] != len(self.low):
            raise ValueError(f"texture model: {len(self.low)} axes expected, {samples.shape[1]} given")
        out = np.zeros(len(self.classes))
        lib.nav_texture_loglik(self._model, doubles(samples), len(samples), doubles(out))
        return out

    def save(self, path) -> None:
        content = {"format": FORMAT, "classes": self.classes}
        content |= {key: getattr(self, key).tolist() for key in ("rest", "low", "high")}
        content["loglik"] = np.round(self.table, 6).tolist()
        Path(path).write_text(json.dumps(content) + "\n")

    @classmethod
    def load(cls, path) -> "TextureModel":
        """Read what `save` wrote; TableError with one line when it is something else."""
        try:
            content = json.loads(Path(path).read_text())
            if content["format"] != FORMAT:
                raise ValueError(f"format is '{content['format']}'")
            table = np.array(content["loglik"], dtype=np.float64)
            edges = [np.array(content[key], dtype=np.float64) for key in ("rest", "low", "high")]
            if table.shape[:2] != (len(content["classes"]), len(edges[1])) or len({len(e) for e in edges}) != 1:
                raise ValueError("sizes of classes, axes and loglik differ")
            if not all(np.isfinite(part).all() for part in (table, *edges)):
                raise ValueError("a number is not finite")
            return cls(content["classes"], *edges, table)
        except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
            raise TableError(
                path, None, f"not a texture model ({error!r}); make one with 'whisker texture train'"
            ) from error


@dataclass
class Decision:
    """What one window says."""

    t_s: float  # end of the window
    loglik: dict[str, float]
    label: str  # a class, or "unknown" when no sample could be read
    confidence: float  # tempered posterior of the label under equal priors
    border: bool  # the two halves of the window name different classes, each with confidence


def posterior(loglik: np.ndarray, temper: float = TEMPER) -> np.ndarray:
    """Tempered posterior over classes under equal priors."""
    weight = np.exp(temper * (loglik - loglik.max()))
    return weight / weight.sum()


def classify(model: TextureModel, t_s: np.ndarray, samples: np.ndarray, window_ms: float = 100.0) -> list[Decision]:
    """Decide window by window: t_s (n,), samples (n, axes); a last, shorter window is left out."""
    length = max(2, round(window_ms / 1000.0 / sample_period(t_s)))
    starts = range(0, len(samples) - length + 1, length)
    return [_decide(model, float(t_s[s + length - 1]), samples[s : s + length]) for s in starts]


def _decide(model: TextureModel, t_s: float, window: np.ndarray) -> Decision:
    loglik = model.loglik(window)
    if not np.isfinite(window).all(axis=1).any():
        return Decision(t_s, dict.fromkeys(model.classes, 0.0), "unknown", 0.0, False)
    chance = posterior(loglik)
    best = int(chance.argmax())
    halves = [posterior(model.loglik(half)) for half in np.array_split(window, 2)]
    border = halves[0].argmax() != halves[1].argmax() and min(h.max() for h in halves) > 0.9
    by_class = dict(zip(model.classes, map(float, loglik), strict=True))
    return Decision(t_s, by_class, model.classes[best], float(chance[best]), bool(border))


def read_recording(path) -> tuple[np.ndarray, np.ndarray]:
    """One CSV recording -> t_s (n,), channels (n, axes)."""
    text = read_columns(path, required=["t_s"])
    channels = [name for name in text if name != "t_s"]
    if not channels:
        raise TableError(path, 1, "no channel column beside t_s; name at least one, as in 't_s,x,y'")
    return numbers(text["t_s"]), np.column_stack([numbers(text[name]) for name in channels])


def read_folder(path) -> dict[str, list[np.ndarray]]:
    """One folder per surface, one CSV per recording -> channels by class."""
    surfaces = sorted(folder for folder in Path(path).iterdir() if folder.is_dir()) if Path(path).is_dir() else []
    found = {s.name: [read_recording(f)[1] for f in sorted(s.glob("*.csv"))] for s in surfaces}
    empty = [name for name, recordings in found.items() if not recordings]
    if len(found) < 2 or empty:
        what = f"folder '{empty[0]}' holds no CSV file" if empty else f"{len(found)} surface folder(s)"
        raise TableError(path, None, f"{what}; give at least two folders, one per surface, with CSV recordings")
    widths = {r.shape[1] for group in found.values() for r in group}
    if len(widths) != 1:
        raise TableError(path, None, f"recordings have {sorted(widths)} channels; give all the same columns")
    return found


def sample_period(t_s: np.ndarray) -> float:
    """Median step of the time column, s."""
    steps = np.diff(t_s[np.isfinite(t_s)])
    steps = steps[steps > 0]
    return float(np.median(steps)) if len(steps) else 0.0005


def _counts(samples) -> np.ndarray:
    samples = np.asarray(samples, dtype=np.float64)
    return samples.reshape(len(samples), -1)


def _ranges(samples: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Range of each axis: all but the tails, in bins no narrower than the sensor's own step (12 of 16 bits)."""
    low, high = np.quantile(samples, [TAIL, 1.0 - TAIL], axis=0)
    for axis in range(samples.shape[1]):
        values = np.unique(samples[:, axis])
        step = float(np.diff(values).min()) if len(values) > 1 else 1.0
        middle, width = (low[axis] + high[axis]) / 2.0, max(high[axis] - low[axis], step * bins)
        low[axis], high[axis] = middle - 0.55 * width, middle + 0.55 * width
    return low, high
