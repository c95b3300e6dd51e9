"""Frames of the executed Pico against the log of its sensors' conversions (sim/pico/serve.mjs); for guests, too: no NumPy."""

import struct
from collections.abc import Iterable, Sequence
from pathlib import Path

NEAR = 1.5  # counts that the firmware's angle may be off by (sim/pico/tests/bench.mjs); one conversion beside is hundreds off
SURE = 100  # readings in a row that place a run in the log
CONVERSION = struct.Struct("<IIff")  # lane, pulse, alpha, beta
Readings = Sequence[tuple[int, int, int]]  # of each lane: alpha, beta, status


class Log:
    """What each lane's sensor showed after each pulse of the conversion line."""

    def __init__(self, path: Path):
        data = path.read_bytes()
        whole = len(data) - len(data) % CONVERSION.size
        self._shown = {(lane, pulse): shown for lane, pulse, *shown in CONVERSION.iter_unpack(data[:whole])}
        self._pulses = sorted({pulse for _, pulse in self._shown})

    def compare(self, frames: Iterable[tuple[int, Readings]], lanes: range) -> int:
        """Number of readings compared. AssertionError names the first that is not what its lane's sensor showed at its tick's pulse.

        `frames`: (tick, readings); where ticks do not follow each other another run begins.
        """
        compared, run, before = 0, [], None
        for tick, readings in frames:
            if before is not None and tick != before + 1:
                compared += self._compare_run(run, lanes)
                run = []
            run.append((tick, readings))
            before = tick
        return compared + self._compare_run(run, lanes)

    def _compare_run(self, run: list[tuple[int, Readings]], lanes: range) -> int:
        good = [(tick, lane, readings[lane]) for tick, readings in run for lane in lanes if readings[lane][2] == 0]
        if not good:
            return 0
        first = good[: SURE * len(lanes)]
        tick = first[0][0]
        places = [pulse - tick for pulse in self._pulses if all(self._fits(pulse - tick, *one) for one in first)]
        assert len(places) == 1, f"the run of tick {tick} fits {len(places)} places of the log"
        for one in good:
            assert self._fits(places[0], *one), f"tick {one[0]}, lane {one[1]}: {one[2]} is not what the sensor showed"
        return len(good)

    def _fits(self, place: int, tick: int, lane: int, reading: tuple[int, int, int]) -> bool:
        shown = self._shown.get((lane, tick + place))
        return shown is not None and all(abs(a - b) <= NEAR for a, b in zip(shown, reading, strict=False))
