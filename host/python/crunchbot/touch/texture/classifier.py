"""The classifier for windows of one length: numbers in NumPy, arithmetic in C (host/nav/touch/texture/texture_classifier.h)."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...native import as_doubles, doubles, ffi, lib

NONE = np.zeros(0)
GOLDEN = (5**0.5 - 1) / 2  # multiples of it are spread evenly over 0 to 1, however many are taken
SHAPE_WINDOWS, HALVINGS = 64, 24  # that thresholds are taken from; of the range in which they are looked for


@dataclass
class Classifier:
    """A classifier for windows of `length` samples; the arrays as in nav_texture_classifier_numbers."""

    length: int
    floor: np.ndarray  # (channels,)
    shape: np.ndarray  # (shape_count(length),) thresholds, or (0,): without
    weight: np.ndarray  # (F, classes)
    bias: np.ndarray  # (classes,)
    behind: float = 1.0  # factor of the evidence of windows behind the first of a row
    span: np.ndarray | None = None  # (channels,) counts: the farthest that a window of this length may reach
    _made: object = field(default=None, repr=False, compare=False)

    ARRAYS = ("floor", "shape", "weight", "bias")
    NUMBERS = ("length", "behind")

    @property
    def native(self) -> ffi.CData:
        """The C classifier; ValueError when the sizes do not fit each other or a number is impossible."""
        if self._made is None:
            self._made = self._make()
        return self._made

    def _make(self):
        features = Reducer(self.floor, self.length, self.shape).count
        shapes = {"floor": self.floor.shape, "bias": self.bias.shape, "weight": (features, len(self.bias))}
        shapes |= {"shape": self.shape.shape} if len(self.shape) else {}
        where, sizes = f"classifier {self.length}", {"classes": len(self.bias), "channels": len(self.floor)}
        return made(
            "classifier", sizes | {n: getattr(self, n) for n in self.NUMBERS} | pointers(self, where, shapes), where
        )


def pointers(part: Any, where: str, shapes: dict[str, tuple]) -> dict:
    """A part's arrays for C, by name; ValueError for one of another shape."""
    arrays = {name: as_doubles(getattr(part, name), f"{where}: {name}", shape) for name, shape in shapes.items()}
    return {name: doubles(array, name, shapes[name]) for name, array in arrays.items()}


def made(kind: str, numbers: dict, where: str) -> ffi.CData:
    """A nav_texture_`kind` of its numbers, which it copies; ValueError when a size or number is impossible."""
    found = getattr(lib, f"nav_texture_{kind}_new")(ffi.new(f"struct nav_texture_{kind}_numbers *", numbers))
    if found == ffi.NULL:
        raise ValueError(f"{where}: a size or number is out of range")
    return ffi.gc(found, getattr(lib, f"nav_texture_{kind}_free"))


class Reducer:
    """Reduces windows of `length` samples to `count` numbers; ValueError for a size out of range."""

    def __init__(self, floor: np.ndarray, length: int, shape: np.ndarray = NONE):
        channels, floor = len(floor), as_doubles(floor, "floor", (len(floor),))
        if len(shape) not in (0, lib.nav_texture_shape_count(length)):
            raise ValueError(f"texture: {len(shape)} thresholds of shape for windows of {length} samples")
        thresholds = doubles(as_doubles(shape, "shape", shape.shape), "shape", shape.shape) if len(shape) else ffi.NULL
        made = lib.nav_texture_features_new(channels, length, doubles(floor, "floor", floor.shape), thresholds)
        if made == ffi.NULL:
            raise ValueError(f"texture: {channels} channels in windows of {length} samples are out of range")
        self._made, self._window = ffi.gc(made, lib.nav_texture_features_free), (length, channels)
        self.count = lib.nav_texture_features_count(self._made)

    def features(self, window: np.ndarray) -> np.ndarray:
        """Window (length, channels) -> features (count,)."""
        out = np.empty(self.count)
        given = doubles(as_doubles(window, "window", self._window), "window", self._window)
        lib.nav_texture_features_work(self._made, given, doubles(out, "features", out.shape))
        return out


def plain_features(windows: np.ndarray, floor: np.ndarray, shape: np.ndarray = NONE) -> np.ndarray:
    """Windows (m, length, channels) -> features (m, F); as in nav_texture_features_new."""
    windows = as_doubles(windows, "windows", (None, None, len(floor)))
    made = Reducer(floor, windows.shape[1], shape)
    return np.array([made.features(window) for window in windows]).reshape(-1, made.count)


def shape_thresholds(windows: np.ndarray, floor: np.ndarray) -> np.ndarray:
    """For windows (m, length, channels): each kernel's output is above its threshold in a share of places that goes
    through all shares from kernel to kernel. (0,) where the windows are too short."""
    count = lib.nav_texture_shape_count(windows.shape[1])
    some = windows[np.unique(np.linspace(0, len(windows) - 1, SHAPE_WINDOWS).astype(int))]
    wanted = (np.arange(count) * GOLDEN) % 1.0
    low = np.full(count, -27.0 * float(np.ptp(some, axis=1).max()) - 1.0)
    high = -low
    for _ in range(HALVINGS if count else 0):
        middle = 0.5 * (low + high)
        more = plain_features(some, floor, middle)[:, -count:].mean(axis=0) > wanted
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    return high


def blocks_of(samples: np.ndarray, length: int, channels: int) -> np.ndarray:
    """Samples (n, channels) in whole blocks, (n // length, length, channels)."""
    samples = as_doubles(samples, "samples", (None, channels))
    whole = len(samples) // length
    return samples[: whole * length].reshape(whole, length, channels)
