"""What texture windows say of each tile of a known floor, against what the map says of it.

A window counts where the pose is known so well that its tip is on that tile alone. So the known ground around the tile
fixes the pose, not the tile itself.
"""

import math

import numpy as np

from ..scene import NOT_KNOWN_INDEX, Arena, Robot
from .actions import LEVER_M, REPEATED

Tile = tuple[int, int]  # column and row, row 0 the smallest y
WRONG = 0.15  # of windows that say one texture, on top of what they say themselves
AS_MAPPED = 0.5  # prior of a tile that is suspected
SURE = 0.999  # probability from which a tile's texture is known
WINDOWS_LEAST = 10  # a run of windows that are wrong together is shorter
PLACED, SPREAD_M = 0.9, 0.1  # confidence and standard deviation of a pose whose windows count
SIGMAS = 2.0  # standard deviations by which a tip is within its tile


class Tiles:
    """`take` each row's windows; `posterior` of a tile's textures, a tile being as mapped with probability AS_MAPPED."""

    def __init__(self, arena: Arena, robot: Robot):
        self.edge_m, self.mapped = arena.tile_m, arena.floor_indices()
        self.textures = arena.textures
        self._tips = np.array([whisker.tip_m for whisker in robot.of_role("texture")]).reshape(-1, 2)
        self._log = np.zeros((*self.mapped.shape, len(arena.textures)))
        self._windows = np.zeros(self.mapped.shape, int)
        self._before: list[tuple[Tile, int] | None] = [None] * len(self._tips)

    def take(self, pose: np.ndarray, covariance: np.ndarray, confidence: float, windows: np.ndarray) -> None:
        """A row: the pose (3,) at its end with covariance (3, 3), and log-likelihoods (tips, textures), nan not read."""
        sigma = math.sqrt(max(covariance[0, 0] + covariance[1, 1], 0.0) / 2.0 + LEVER_M**2 * max(covariance[2, 2], 0.0))
        placed = is_placed(covariance, confidence)
        c, s = math.cos(pose[2]), math.sin(pose[2])
        for n, (x, y) in enumerate(self._tips):
            at = np.array([pose[0] + c * x - s * y, pose[1] + s * x + c * y]) / self.edge_m
            column, row = np.floor(at).astype(int)
            inside = self.edge_m * min((at - (column, row)).min(), ((column, row) + np.ones(2) - at).min())
            on = 0 <= row < self.mapped.shape[0] and 0 <= column < self.mapped.shape[1]
            if not (placed and on and inside > SIGMAS * sigma and np.isfinite(windows[n]).all()):
                self._before[n] = None
                continue
            likely = np.exp(windows[n] - windows[n].max())
            likely = (1.0 - WRONG) * likely / likely.sum() + WRONG / len(likely)
            said = (int(column), int(row)), int(likely.argmax())
            self._log[row, column] += (REPEATED if said == self._before[n] else 1.0) * np.log(likely)
            self._windows[row, column] += 1
            self._before[n] = said

    def posterior(self, tile: Tile) -> np.ndarray:
        """(textures,) probabilities."""
        column, row = tile
        count, mapped = len(self.textures), self.mapped[row, column]
        prior = np.full(count, 1.0 / count)
        if mapped != NOT_KNOWN_INDEX and count > 1:
            prior = np.full(count, (1.0 - AS_MAPPED) / (count - 1))
            prior[mapped] = AS_MAPPED
        log = np.log(prior) + self._log[row, column]
        likely = np.exp(log - log.max())
        return likely / likely.sum()

    def known(self, tile: Tile) -> int | None:
        """Index of the texture that a tile has for sure; None: it is not known yet."""
        posterior = self.posterior(tile)
        sure = posterior.max() >= SURE and self._windows[tile[1], tile[0]] >= WINDOWS_LEAST
        return int(posterior.argmax()) if sure else None

    def suspected(self) -> Tile | None:
        """The tile that is most likely otherwise than mapped, if more likely than not; None: there is none."""
        worst, found = AS_MAPPED, None
        for row, column in np.argwhere((self._windows > 0) & (self.mapped != NOT_KNOWN_INDEX)):
            otherwise = 1.0 - self.posterior((column, row))[self.mapped[row, column]]
            if otherwise > worst:
                worst, found = otherwise, (int(column), int(row))
        return found


def is_placed(covariance: np.ndarray, confidence: float) -> bool:
    """Whether a pose is known well enough to say which tile is read."""
    return confidence >= PLACED and math.sqrt(max(covariance[0, 0], covariance[1, 1], 0.0)) <= SPREAD_M
