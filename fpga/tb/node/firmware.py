"""The node's firmware on its register model, through the shared library that the build makes of tests/rigs/node."""

import ctypes
import os
from dataclasses import dataclass

from bench import REPO

SYNC, SELECT, SCK, MOSI = range(4)  # enum sim_node_pin
GOOD, FLIP_BIT, DEAD, STUCK_LOW = range(4)  # enum sim_sensor_fault
LOST_CLOCK = 7


def _library() -> ctypes.CDLL:
    path = REPO / os.environ.get("WHISKER_BUILD", "build/release") / "tests/rigs/node/libsim_node_pins.so"
    if not path.exists():
        raise FileNotFoundError(f"{path}: the bench of node and bridge needs it; run 'make build' first")
    library = ctypes.CDLL(str(path))
    library.node_pins_new.restype = ctypes.c_void_p
    library.node_pins_new.argtypes = [ctypes.c_uint64, ctypes.c_int32, ctypes.c_uint, ctypes.c_uint, ctypes.c_uint]
    library.node_pins_field.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double]
    library.node_pins_fault.argtypes = [ctypes.c_void_p, ctypes.c_uint, ctypes.c_uint]
    library.node_pins_play.argtypes = [ctypes.c_void_p, ctypes.c_uint] + [ctypes.c_void_p] * 4
    library.node_pins_free.argtypes = library.node_pins_violations.argtypes = [ctypes.c_void_p]
    return library


@dataclass(frozen=True)
class Parts:
    """What a node is made of: oscillators off by so much, the SPI slave's prefetch, the DMA's latency."""

    seed: int
    frc_ppm: int
    prefetch: int
    sensor_permille: int
    dma_cycles: int = 8


class Node:
    """One node, ready for its first SYNC at time 0."""

    def __init__(self, parts: Parts):
        self.library = _library()
        self.handle = self.library.node_pins_new(
            parts.seed, parts.frc_ppm, parts.prefetch, parts.dma_cycles, parts.sensor_permille
        )
        assert self.handle

    def set(self, alpha_deg: float, beta_deg: float, fault: int = GOOD, argument: int = 0) -> None:
        """Field and sensor fault of the reading that the next SYNC played starts."""
        self.library.node_pins_field(self.handle, alpha_deg, beta_deg)
        self.library.node_pins_fault(self.handle, fault, argument)

    def play(self, edges: list[tuple[int, int, int]]) -> list[int]:
        """Plays edges (time in ps, pin, level); MISO's level after each."""
        count = len(edges)
        times = (ctypes.c_uint64 * count)(*(t for t, _, _ in edges))
        pins = (ctypes.c_uint8 * count)(*(p for _, p, _ in edges))
        levels = (ctypes.c_uint8 * count)(*(v for _, _, v in edges))
        miso = (ctypes.c_uint8 * count)()
        self.library.node_pins_play(self.handle, count, times, pins, levels, miso)
        return list(miso)

    def violations(self) -> int:
        """Breaches of the sensor's and the chip's data sheets so far."""
        return self.library.node_pins_violations(self.handle)

    def free(self) -> None:
        self.library.node_pins_free(self.handle)
