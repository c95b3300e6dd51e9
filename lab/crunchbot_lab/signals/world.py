"""A simulated world to step through: drive in, sensor counts and reported odometry out."""

from typing import NamedTuple

import numpy as np

from .border import ffi, lib, pointer

TICK_S = 500e-6  # one sample of every whisker


class Contact(NamedTuple):
    """What an object whisker touches: the world's knowledge, for truth and calibration benches, never for decisions."""

    touching: bool
    corner: bool
    radius_m: float
    theta_rad: float
    amplitude_gain: float


class Tip(NamedTuple):
    """Where a texture whisker's tip is: the world's knowledge, for truth only."""

    x: float
    y: float
    texture: str
    inside_m: float
    travelled_m: float
    caught: bool


class World:
    """A robot in an arena, from a scene's flat text (sim/world/sim_scene.h). Equal text, seed and calls: equal counts."""

    def __init__(self, flat: str, seed: int):
        self._scene = ffi.new("struct sim_scene *")
        error = ffi.new("char[256]")
        if lib.sim_scene_parse(flat.encode(), b"scene", self._scene, error, len(error)):
            raise ValueError(ffi.string(error).decode())
        self._world = ffi.gc(lib.sim_world_new(self._scene, seed), lib.sim_world_free)
        if not self._world:
            raise MemoryError("no memory for a simulated world")
        self.lanes = tuple(ffi.string(self._scene.whisker[i].name).decode() for i in range(self._scene.whiskers))
        self.textures = tuple(ffi.string(self._scene.texture[i]).decode() for i in range(self._scene.textures))

    def drive(self, v_m_s: float, omega_rad_s: float) -> None:
        """Command the base from the next tick on."""
        lib.sim_world_drive(self._world, v_m_s, omega_rad_s)

    def run(self, ticks: int) -> np.ndarray:
        """Let ticks pass. Raw counts, shape (ticks, lanes, 2), uint16; axis 0 of the last is alpha, 1 is beta."""
        counts = np.empty((ticks, len(self.lanes), 2), dtype=np.uint16)
        lib.sim_signals_run(self._world, ticks, pointer("uint16_t[]", counts, "counts", (ticks, len(self.lanes), 2)))
        return counts

    def odometry(self) -> tuple[float, float, float]:
        """Reported motion since the last call (m, m, rad), in the frame of the last call."""
        motion = ffi.new("double[3]")
        lib.sim_world_odometry(self._world, motion, motion + 1, motion + 2)
        return motion[0], motion[1], motion[2]

    @property
    def pose(self) -> tuple[float, float, float]:
        """True x, y (m) and heading (rad, in (-pi, pi])."""
        pose = lib.sim_world_pose(self._world)
        return pose.x, pose.y, pose.theta

    @property
    def blocked(self) -> bool:
        """Whether the body pushed against a wall or an obstacle at the last tick."""
        return lib.sim_world_blocked(self._world)

    def contact(self, lane: int) -> Contact:
        """Truth about an object whisker."""
        c = lib.sim_world_contact(self._world, lane)
        return Contact(c.touching, c.corner, c.radius_m, c.theta_rad, c.amplitude_gain)

    def spread(self, lane: int) -> float:
        """Relative spread of an object whisker's amplitude from whisk to whisk."""
        return lib.sim_world_spread(self._world, lane)

    def tip(self, lane: int) -> Tip:
        """Truth about a texture whisker."""
        tip = lib.sim_world_tip(self._world, lane)
        return Tip(tip.x, tip.y, self.textures[tip.texture], tip.inside_m, tip.travelled_m, tip.caught)
