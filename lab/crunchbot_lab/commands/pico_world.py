"""The world behind the executed Pico: a robot on its course, and the fields that its sensors are given, tick by tick."""

import itertools
import threading
from pathlib import Path

import numpy as np

from ..signals import World
from ..simulation.bridge import BLOCK_TICKS, turns

REST = 0x8000  # of a lane that the scene has no whisker for


class Fields(threading.Thread):
    """Writes two angles of each lane and tick into a named pipe, as counts, until the board has ended (sim/pico/serve.mjs)."""

    def __init__(self, pipe: Path, flat: str, seed: int, drive: str, lanes: int):
        """`flat`: the scene; `drive`: one of COURSES."""
        super().__init__(daemon=True)
        self._pipe, self._world, self._turns, self._lanes = pipe, World(flat, seed), turns(drive), lanes

    def run(self) -> None:
        block = np.full((BLOCK_TICKS, self._lanes, 2), REST, "<u2")
        try:
            with self._pipe.open("wb", buffering=0) as pipe:
                for turn in itertools.cycle(self._turns):
                    self._world.drive(0.0, turn)
                    block[:, : len(self._world.lanes)] = self._world.run(BLOCK_TICKS)
                    pipe.write(block.tobytes())
        except BrokenPipeError:
            return
