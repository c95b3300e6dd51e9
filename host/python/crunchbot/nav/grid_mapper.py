"""The grid mapper of host/nav/mapping/grid: Rao-Blackwellised particles, each with a grid map of its own path."""

from typing import Any

import numpy as np

from ..native import lib
from ..scene import Robot
from .mapper import FACE, FACES, Mapper, Part, TouchMap


class GridMapper(Mapper):
    """As Mapper; its map is cells, and faces where contacts of several cells lie in a row. It knows no lattice."""

    PREFIX = "nav_grid_mapper"

    def __init__(
        self,
        robot: Robot,
        textures: tuple[str, ...],
        seed: int = 0,
        particles: int | None = None,
        lattice: bool = False,
        normals: bool = False,
        surface: bool = True,
    ):
        """`surface`: poses are proposed where contacts lie on the map's surfaces, too; else by the odometry alone. `lattice` is
        not used. MappingError when an option is out of range, or there is no memory."""
        self._surface = surface
        super().__init__(robot, textures, seed, particles, lattice, normals)

    def _options(self, particles: int, lattice: bool) -> dict[str, Any]:
        return {"particles": particles, "surface": self._surface}

    def map(self) -> TouchMap:
        """The map after the last row."""
        return TouchMap(self.faces(), None, None, {}, grid=self._grid())

    def parts(self) -> list[Part]:
        """One: a robot that is carried off is not noticed."""
        return [Part(0, 0, 0, None, None, None)]

    @property
    def frame(self) -> int:
        return 0

    def faces(self) -> np.ndarray:
        """(n,) of FACE."""
        return self._listed(self._function("faces"), FACES, FACE, "faces", lib.NAV_GRID_FACES_MOST)

    @property
    def evidence(self) -> float:
        """Log-likelihood of all rows up to the last contact."""
        return lib.nav_grid_mapper_evidence(self._mapper)
