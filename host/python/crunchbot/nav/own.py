"""A sensor of a user's own as two NumPy functions: what it should read at a place, and how likely a reading then is."""

import time
from collections.abc import Callable

import numpy as np

from .filters import SENSOR_UNKNOWN, Sensor, SettingError

CODES_MOST = 255
CELLS_MOST = 10**7


class OwnSensor:
    """`sensor` goes to Filter(..., sensors=[...]); what `read` gives, to its rows (Observations.own, step_values).

    The functions are the user's. What they do wrong costs readings, never a run: `raised`, `bad` (no likelihoods) and
    `slow` count it, `last_error` is the last such reading's reason in one line.
    """

    def __init__(
        self,
        size_m: tuple[float, float],
        cell_m: float,
        expected: Callable[[np.ndarray, np.ndarray], np.ndarray],
        loglik: Callable[[object, np.ndarray], np.ndarray],
        levels: np.ndarray,
        at_m: tuple[float, float] = (0.0, 0.0),
        spacing_m: float = 0.0,
        detail_m: float = 0.0,
        budget_s: float | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ):
        """expected(x, y): what the sensor should read at places (n,), (n,) in m, (n,); nan: nobody knows. loglik(reading,
        levels): log-likelihood (codes,) of a reading where the levels (codes,) are expected. levels: at most 255 rising
        values, to the nearest of which what is expected is rounded. cell_m: places are distinguished so far. at_m,
        spacing_m, detail_m: as those of Sensor. budget_s: of loglik's time for each reading on average; what takes more is left
        out (`skipped`); None: nothing is.
        """
        self.levels = np.asarray(levels, np.float64)
        if self.levels.ndim != 1 or not 1 <= len(self.levels) <= CODES_MOST or (np.diff(self.levels) <= 0).any():
            raise SettingError(f"levels: not 1 to {CODES_MOST} rising numbers; give such")
        self._loglik, self._budget_s, self._clock, self._debt_s = loglik, budget_s, clock, 0.0
        self.raised = self.bad = self.slow = self.skipped = 0
        self.last_error = ""
        self.sensor = Sensor(
            _codes(size_m, cell_m, expected, self.levels), cell_m, at_m, spacing_m, detail_m, len(self.levels)
        )

    def read(self, reading: object) -> np.ndarray:
        """(codes,) log-likelihoods of a reading; all nan: it is left out."""
        if self._budget_s is not None and self._debt_s >= self._budget_s:
            self._debt_s -= self._budget_s
            self.skipped += 1
            return self._nothing()
        began = self._clock()
        out = self._called(reading)
        self._note_time(self._clock() - began)
        return out

    def _called(self, reading) -> np.ndarray:
        try:
            out = np.asarray(self._loglik(reading, self.levels), np.float64)
        except Exception as error:  # whatever the user's function may raise
            self.raised += 1
            self.last_error = " ".join(f"{type(error).__name__}: {error}".split())[:200]
            return self._nothing()
        if out.shape != self.levels.shape or not (out < np.inf).all() or not np.isfinite(out).any():
            self.bad += 1
            self.last_error = (
                f"shape {out.shape} with {np.isnan(out).sum()} nan; {self.levels.shape} numbers are wanted"
            )
            return self._nothing()
        return out - out.max()

    def _note_time(self, took_s: float) -> None:
        if self._budget_s is not None and took_s > self._budget_s:
            self.slow += 1
            self.last_error = f"took {1000 * took_s:.0f} ms, {1000 * self._budget_s:.0f} are granted"
            self._debt_s += took_s - self._budget_s

    def _nothing(self) -> np.ndarray:
        return np.full(len(self.levels), np.nan)


def _codes(size_m, cell_m: float, expected: Callable, levels: np.ndarray) -> np.ndarray:
    """(rows, columns) number of the nearest level at each cell's middle."""
    columns, rows = (int(np.ceil(side / cell_m - 1e-6)) if cell_m > 0.0 else 0 for side in size_m)
    if not 1 <= columns * rows <= CELLS_MOST:
        raise SettingError(f"cell_m: {columns} x {rows} cells; give one to {CELLS_MOST:g} of them")
    x, y = (
        np.ravel(place) for place in np.meshgrid((np.arange(columns) + 0.5) * cell_m, (np.arange(rows) + 0.5) * cell_m)
    )
    try:
        value = np.asarray(expected(x, y), np.float64)
    except Exception as error:  # whatever the user's function may raise
        raise SettingError(
            f"expected: {' '.join(f'{type(error).__name__}: {error}'.split())[:200]}; mend it"
        ) from error
    if value.shape != x.shape:
        raise SettingError(f"expected: gave shape {value.shape} for {len(x)} places; give one value for each")
    code = np.searchsorted((levels[1:] + levels[:-1]) / 2, np.nan_to_num(value)).astype(np.uint8)
    return np.where(np.isfinite(value), code, SENSOR_UNKNOWN).astype(np.uint8).reshape(rows, columns)
