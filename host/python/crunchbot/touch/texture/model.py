"""Floor texture: the stationary naive Bayes classifier (paper, equation 1), recordings, and decisions of any model."""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...fields import Fields
from ...files import UnreadableError, read_json
from ...native import as_doubles, lib
from ...outputs import put
from ...tables import TableError, Warn, ignore, numbers, read_columns
from .spectral import FORMAT as SPECTRAL_FORMAT
from .spectral import SENSOR_STOPS, SpectralModel, no_model

FORMAT = "whisker texture model 1"
BINS = 64
PSEUDO = 1.0  # Laplace: one sample more in every bin
TAIL = 0.0005  # share of the training samples on each side that the range leaves to the end bins
TEMPER = 0.05  # 200 samples of 100 ms are worth 2-20 independent ones (whisker_physics section 7)
SURE = 0.99  # posterior at which a sequential decision of equation 1 stops ...
LOOKS = 8  # ... looking so often in a window ...
PATIENCE = 4  # ... and giving up after so many windows
GAP_PERIODS = 4.0  # a longer step of the time column is a gap: no window reaches across it
STOPPED_MOST = 0.01  # share of a channel's samples at a stop of the sensor that is worth a word
STUCK_LEAST, STUCK_MOST = 16, 0.25  # samples, and share of a recording, that one value may last
NO_DIGITS = str.maketrans("", "", "0123456789")
SPEED = "speed_m_s"  # column of how fast the tip goes; no channel
RATES_APART = 0.1  # relative: recordings to be learnt together are sampled alike


class TextureModel:
    """One whisker's model: class names in order, rest and bins by axis, log P(x|T) by class, axis and bin."""

    def __init__(self, classes: list[str], rest: ArrayLike, low: ArrayLike, high: ArrayLike, table: np.ndarray):
        """rest, low, high: one number per axis, counts (low and high relative to rest); table (classes, axes, bins)."""
        self.classes, self.table = list(classes), table
        self.rest = np.atleast_1d(np.asarray(rest, dtype=np.float64))
        self.low = as_doubles(low, "low", self.rest.shape)
        self.high = as_doubles(high, "high", self.rest.shape)
        if not (np.isfinite(self.low) & np.isfinite(self.high) & (self.low < self.high)).all():
            raise ValueError("texture model: every range needs low < high")

    @classmethod
    def train(
        cls, recordings: dict[str, list[np.ndarray]], rest: ArrayLike | None = None, bins: int = BINS
    ) -> TextureModel:
        """Learn from raw counts, arrays (n, axes) by class. `rest`: by axis; default the median of all training data."""
        recordings = {name: [_counts(r, "recording") for r in group] for name, group in recordings.items()}
        widths = {r.shape[1] for group in recordings.values() for r in group}
        if len(widths) != 1:
            raise ValueError(f"texture training: recordings of {sorted(widths)} channels; give recordings of one width")
        by_class = [np.concatenate(group) for group in recordings.values()]
        everything = np.concatenate(by_class)
        everything = everything[np.isfinite(everything).all(axis=1)]
        if len(everything) == 0:
            raise ValueError("texture training: no finite sample; record each surface for some seconds")
        rest = np.median(everything, axis=0) if rest is None else np.broadcast_to(rest, everything.shape[1:])
        low, high = _ranges(everything - rest, bins)
        model = cls(list(recordings), rest, low, high, np.zeros((len(recordings), everything.shape[1], bins)))
        for rows, samples in zip(model.table, by_class, strict=True):
            rows[:] = model._histogram(samples, rest)
        model.table = np.log((model.table + PSEUDO) / (model.table + PSEUDO).sum(axis=2, keepdims=True))
        return model

    def _histogram(self, samples: np.ndarray, rest: np.ndarray) -> np.ndarray:
        """Samples (n, axes) of raw counts -> how many of those that are finite lie in each bin, (axes, bins)."""
        samples = samples[np.isfinite(samples).all(axis=1)] - rest
        bins = self.table.shape[2]
        places = np.clip((samples - self.low) * (bins / (self.high - self.low)), 0, bins - 1).astype(int)
        return np.array([np.bincount(axis, minlength=bins) for axis in places.T])

    def loglik(self, window: np.ndarray, rest: ArrayLike | None = None) -> np.ndarray:
        """Equation 1: log-likelihood of the window (n, axes) of raw counts by class. `rest`: default the model's."""
        rest = self.rest if rest is None else as_doubles(rest, "rest", (self.channels,))
        histogram = self._histogram(_counts(window, "window", self.channels), rest)
        return self.table.reshape(len(self.classes), -1) @ histogram.ravel()

    def save(self, path: str | Path) -> None:
        content = {"format": FORMAT, "classes": self.classes}
        content |= {key: getattr(self, key).tolist() for key in ("rest", "low", "high")}
        content["loglik"] = np.round(self.table, 6).tolist()
        put(path, json.dumps(content) + "\n")

    @classmethod
    def from_json(cls, path: str | Path, content: object) -> TextureModel:
        """What `save` wrote, parsed; TableError with one line when it is something else."""
        try:
            return cls._of(Fields(content))
        except (ValueError, OverflowError) as error:
            raise no_model(path, error) from error

    @classmethod
    def _of(cls, fields: Fields) -> TextureModel:
        fields.text("format", FORMAT)
        classes = fields.names("classes", lib.NAV_TEXTURE_CLASSES_MAX)
        edges = [fields.array(key, 1) for key in ("rest", "low", "high")]
        table = fields.array("loglik", 3, high=0.0)
        if table.ndim != 3 or table.shape[:2] != (len(classes), len(edges[1])):
            raise ValueError("sizes of classes, axes and loglik differ")
        return cls(classes, *edges, table)

    @property
    def channels(self) -> int:
        return len(self.low)


def load(path: str | Path) -> TextureModel | SpectralModel:
    """A model of either method, as its format says."""
    try:
        content = read_json(path)
    except UnreadableError as error:
        raise no_model(path, error) from error
    known = content.get("format") if isinstance(content, dict) else None
    if known == SPECTRAL_FORMAT:
        return SpectralModel.from_json(path, content)
    if isinstance(known, str) and known.startswith(FORMAT.rstrip("1")) and known != FORMAT:
        text = f"format '{known}' is of another release, which reads no other; this one reads '{SPECTRAL_FORMAT}'"
        raise no_model(path, ValueError(text))
    return TextureModel.from_json(path, content)


@dataclass
class Decision:
    """What one window says."""

    t_s: float  # end of the window
    loglik: dict[str, float]  # of the window alone
    label: str  # a class, or "unknown"
    best: str  # the likeliest class, whatever the label
    confidence: float  # its probability: by equation 1, tempered, of the window; by default given all windows so far


def posterior(loglik: np.ndarray, temper: float = TEMPER) -> np.ndarray:
    """Tempered posterior over classes under equal priors."""
    weight = np.exp(temper * (loglik - loglik.max()))
    return weight / weight.sum()


def classify(
    model: Any, t_s: np.ndarray, samples: np.ndarray, window_ms: float = 100.0, sequential: bool = False
) -> list[Decision]:
    """Decide window by window, or as soon as sure: t_s (n,), samples (n, axes) of raw counts.

    A last, shorter window is left out, and none reaches across a gap of the time column.
    """
    period = sample_period(t_s)
    length = max(2, round(window_ms / 1000.0 / period))
    steps = np.diff(t_s)
    gaps = np.flatnonzero((steps > GAP_PERIODS * period) | (steps <= 0)) + 1
    found = []
    for some_t, some in zip(np.split(t_s, gaps), np.split(np.asarray(samples, float), gaps), strict=True):
        if isinstance(model, SpectralModel):
            found += [_reported(model, some_t, d) for d in model.judge(some, length, sequential)]
        elif sequential:
            found += _sequential(model, some_t, some, length)
        else:
            starts = range(0, len(some) - length + 1, length)
            found += [_decide(model, float(some_t[s + length - 1]), some[s : s + length]) for s in starts]
    return found


def _reported(model: SpectralModel, t_s: np.ndarray, d) -> Decision:
    label = "unknown" if d.label < 0 else model.classes[d.label]
    by_class = dict(zip(model.classes, map(float, d.loglik), strict=True))
    return Decision(float(t_s[d.end - 1]), by_class, label, model.classes[d.best], d.confidence)


def _sequential(model: TextureModel, t_s: np.ndarray, samples: np.ndarray, window: int) -> list[Decision]:
    """Equation 1 until sure: "unknown" when four windows do not make it so."""
    found, start, look = [], 0, max(1, window // LOOKS)
    for end in range(look, len(samples) + 1, look):
        decision = _decide(model, float(t_s[end - 1]), samples[start:end])
        if decision.confidence >= SURE or end - start >= PATIENCE * window:
            decision.label = decision.label if decision.confidence >= SURE else "unknown"
            found.append(decision)
            start = end
    return found


def _decide(model: TextureModel, t_s: float, window: np.ndarray) -> Decision:
    loglik = model.loglik(window)
    if not np.isfinite(window).all(axis=1).any():
        return Decision(t_s, dict.fromkeys(model.classes, 0.0), "unknown", model.classes[0], 0.0)
    chance = posterior(loglik)
    best = model.classes[int(chance.argmax())]
    by_class = dict(zip(model.classes, map(float, loglik), strict=True))
    return Decision(t_s, by_class, best, best, float(chance.max()))


def channel_names(path: str | Path) -> list[str]:
    """The columns of a CSV recording that are channels, in order; TableError without any."""
    return list(_channels(path, read_columns(path, required=["t_s"])))


def _channels(path, columns) -> dict[str, str | None]:
    """Channel -> column that is not 0 where its sample is missing, as `whisker stream` writes them; None: there is none."""
    streamed = {"tick", "sequence"} <= columns.keys()
    others = {"t_s", SPEED, "tick", "sequence"} if streamed else {"t_s", SPEED}
    status = {name for name in columns if streamed and name.endswith("_status")}
    places = {name: f"{name.rpartition('_')[0]}_status" for name in columns if name not in others | status}
    channels = {name: place if place in status else None for name, place in places.items()}
    if not channels:
        raise TableError(path, 1, "no channel column beside t_s; name at least one, as in 't_s,x,y'")
    return channels


def read_recording(
    path: str | Path, order: list[str] | None = None, warn: Warn = ignore
) -> tuple[np.ndarray, np.ndarray]:
    """One CSV recording -> t_s (n,), channels (n, axes). TableError for the channels of `order` in another order.

    `warn(line)` is called with each fault that does not keep it from being read."""
    text = read_columns(path, required=["t_s"])
    places = _channels(path, text)
    channels = list(places)
    if order and channels != order and sorted(channels) == sorted(order):
        raise TableError(path, 1, f"columns {', '.join(channels)}; give {', '.join(order)}, as in training")
    t_s, samples = numbers(text["t_s"]), np.column_stack([numbers(text[name]) for name in channels])
    for channel, place in enumerate(places.values()):
        if place:
            samples[numbers(text[place]) != 0, channel] = np.nan
    if len(t_s) > 1 and not (np.diff(t_s[np.isfinite(t_s)]) > 0).any():
        raise TableError(path, 1, "column 't_s' never increases; give each row its time in seconds")
    if order and channels != order and len(channels) == len(order):
        warn(f"{path}: columns {', '.join(channels)} taken for {', '.join(order)}")
    for fault in recording_faults(samples, t_s):
        warn(f"{path}: {fault}")
    return t_s, samples


def read_training(path: str | Path, warn: Warn = ignore) -> tuple[dict[str, list[np.ndarray]], float]:
    """One folder per surface, one CSV per recording -> channels by class, and the sampling rate (Hz).

    `warn(line)` is called with each fault of a recording that training goes on in spite of."""
    files = surface_files(path)
    if len(files) < 2:
        text = f"{len(files)} surface folder(s); give at least two folders, one per surface, with CSV recordings"
        raise TableError(path, None, text)
    order, periods, found = channel_names(next(iter(files.values()))[0]), {}, {}
    for name, file in ((name, file) for name, some in files.items() for file in some):
        t_s, samples = read_recording(file, order, warn)
        if samples.shape[1] != len(order):
            text = f"{samples.shape[1]} channels; give the {len(order)} of the first recording: {', '.join(order)}"
            raise TableError(file, 1, text)
        if np.isfinite(samples).all(axis=1).sum() < lib.NAV_TEXTURE_LENGTH_MIN:
            text = f"{len(samples)} rows, hardly any with numbers in all channels; record some seconds, or remove it"
            raise TableError(file, None, text)
        found.setdefault(name, []).append(samples)
        periods[file] = sample_period(t_s)
    slow, fast = max(periods, key=periods.get), min(periods, key=periods.get)
    if periods[slow] > (1.0 + RATES_APART) * periods[fast]:
        text = f"recordings are sampled at {1 / periods[slow]:.4g} to {1 / periods[fast]:.4g} Hz; give one rate"
        raise TableError(path, None, f"{text} ({slow.relative_to(path)}, {fast.relative_to(path)})")
    few = [name for name, some in files.items() if len(some) == 1]
    if few:
        warn(f"{path}: one recording of {', '.join(few)}: figures held out are of parts of it; give three or more")
    for one, other in combinations(files, 2):
        if _a_letter_apart(one, other):
            warn(f"{path}: folders '{one}' and '{other}' differ by a letter; if they are one surface, use one name")
    return found, 1.0 / float(np.median(list(periods.values())))


def _a_letter_apart(one: str, other: str) -> bool:
    """Whether a letter is left out, added or another, or two change places; numbers distinguish surfaces."""
    short, long = sorted((one.casefold(), other.casefold()), key=len)
    if short.translate(NO_DIGITS) == long.translate(NO_DIGITS):
        return False
    if len(short) < len(long):
        return any(long[:i] + long[i + 1 :] == short for i in range(len(long)))
    apart = [(a, b) for a, b in zip(short, long, strict=True) if a != b]
    return len(apart) == 1 or (len(apart) == 2 and apart[0] == apart[1][::-1])


def surface_files(path: str | Path) -> dict[str, list[Path]]:
    """The CSV recordings of each surface's folder, by its name; hidden folders and files are left out.

    TableError for a folder without recordings, and for two that differ in upper and lower case only.
    """
    if not Path(path).is_dir():
        raise TableError(path, None, "no such folder; give one with a folder per surface, with CSV recordings")
    visible = [p for p in sorted(Path(path).iterdir()) if not p.name.startswith(".")]
    files = {s.name: [f for f in sorted(s.glob("*.csv")) if f.name[0] != "."] for s in visible if s.is_dir()}
    spelt: dict[str, str] = {}
    for name, some in files.items():
        if not some:
            text = f"folder '{name}' holds no CSV file; give each surface a folder with CSV recordings"
            raise TableError(path, None, text)
        other = spelt.setdefault(name.strip().casefold(), name)
        if other != name:
            raise TableError(path, None, f"folders '{other}' and '{name}' name one surface twice; use one name")
    return files


def speeds(files: list[Path]) -> list[float]:
    """The median speed of each recording that tells it, m/s."""
    known = [numbers(columns[SPEED]) for file in files if SPEED in (columns := read_columns(file, required=["t_s"]))]
    return [float(np.nanmedian(speed)) for speed in known if np.isfinite(speed).any()]


def recording_faults(samples: np.ndarray, t_s: np.ndarray | None = None) -> list[str]:
    """What is wrong with a recording: rows that are not finite, times that do not increase, channels that never change,
    keep one value for long or sit at a sensor's stop."""
    samples = _counts(samples, "recording")
    finite = samples[np.isfinite(samples).all(axis=1)]
    found = [f"{len(samples) - len(finite)} of {len(samples)} rows are not finite and left out"]
    found = found if len(finite) < len(samples) else []
    known = np.zeros(0) if t_s is None else t_s[np.isfinite(t_s)]
    late = 0 if t_s is None else len(t_s) - len(known) + int((np.diff(known) <= 0).sum())
    found += [f"{late} of {len(samples)} times are no number or not after the one before"] if late else []
    low, high = SENSOR_STOPS
    counts = np.array_equal(finite, np.round(finite)) and bool(((finite >= low) & (finite <= high)).all())
    for c, channel in enumerate(finite.T if len(finite) > 1 else (), start=1):
        stopped = np.isin(channel, SENSOR_STOPS).mean() if counts else 0.0
        run = longest_run(channel)
        if run == len(channel):
            found.append(f"channel {c} never changes")
        elif stopped > STOPPED_MOST:
            found.append(f"channel {c} is at its stop in {100 * stopped:.0f} % of its samples")
        elif run > max(STUCK_LEAST, STUCK_MOST * len(channel)):
            found.append(f"channel {c} keeps one value for {run} of its {len(channel)} samples")
    return found


def rate_faults(t_s: np.ndarray, trained_hz: float) -> list[str]:
    """That a recording is sampled at another rate than those of training."""
    rate_hz = 1.0 / sample_period(t_s)
    apart = len(t_s) > 1 and not 1.0 - RATES_APART < rate_hz / trained_hz < 1.0 + RATES_APART
    return (
        [f"sampled at {rate_hz:.4g} Hz, the model's recordings at {trained_hz:.4g} Hz; give one rate"] if apart else []
    )


def longest_run(x: np.ndarray) -> int:
    """The length of the longest run of equal samples."""
    changes = np.flatnonzero(np.diff(x)) + 1
    return int(np.diff(np.concatenate([[0], changes, [len(x)]])).max())


def sample_period(t_s: np.ndarray) -> float:
    """Median step of the time column, s."""
    steps = np.diff(t_s[np.isfinite(t_s)])
    steps = steps[steps > 0]
    return float(np.median(steps)) if len(steps) else 0.0005


def _counts(samples, name: str, channels: int | None = None) -> np.ndarray:
    """Samples (n, channels), or (n,) of one channel, as (n, channels)."""
    samples = np.asarray(samples, dtype=np.float64)
    return as_doubles(samples[:, None] if samples.ndim == 1 else samples, name, (None, channels))


def _ranges(samples: np.ndarray, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Range of each axis: all but the tails, in bins no narrower than the sensor's own step (12 of 16 bits)."""
    low, high = np.quantile(samples, [TAIL, 1.0 - TAIL], axis=0)
    for axis in range(samples.shape[1]):
        values = np.unique(samples[:, axis])
        step = float(np.diff(values).min()) if len(values) > 1 else 1.0
        middle, width = (low[axis] + high[axis]) / 2.0, max(high[axis] - low[axis], step * bins)
        low[axis], high[axis] = middle - 0.55 * width, middle + 0.55 * width
    return low, high
