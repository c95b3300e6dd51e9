"""A bridge under test: whether it is there, who runs on it, one run of frames for all checks that look at frames."""

import os
import subprocess
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from checks import CheckError, SkipError, require, skip, until

from crunchbot.bridge import usbtree
from crunchbot.bridge.ring import Clock, DaemonStats, Reader, RingError
from crunchbot.programs import program
from crunchbot.touch.calibration import TICKS_PER_S
from whisker_protocol import CODES, LANES, STATUS_CODE_SHIFT

START_S = 60.0  # for whiskerd to open its bridge; a simulation may be slow
SILENCE_S = 30.0  # without a frame
SETTLE_TICKS = 200  # 0.1 s: nodes that had no SYNC before begin with records that say so
NO_NODES = "nodes: none answers on any lane"


@dataclass
class Stream:
    """What whiskerd delivered in one run: frames, what it said of itself, its clock half way and at the end."""

    frames: np.ndarray
    stats: DaemonStats
    half: Clock | None
    clock: Clock | None


@dataclass
class Rig:
    """The bridge under test and how it is to be tested."""

    seconds: float  # of frames
    interactive: bool  # a person is there to pull the plug
    simulated: bool  # time is not the wall clock's: reported, not judged
    root: Path  # of the file system; another only in tests
    unusable: str = ""  # why nothing more can be made with it
    _stream: Stream | CheckError | None = field(default=None, repr=False)

    @property
    def bridge(self) -> usbtree.Bridge:
        """The bridge. SkipError: none is plugged in, or it cannot be used."""
        found = usbtree.bridges(self.root)
        if not found:
            raise SkipError("bridge: not plugged in")
        return found[0] if not self.unusable else skip(self.unusable)

    def require(self) -> None:
        """SkipError as from `bridge`."""
        _ = self.bridge

    @property
    def stream(self) -> Stream:
        """One run for all checks that look at frames."""
        if self._stream is None:
            try:
                self._stream = take_stream(self)
            except CheckError as error:
                self._stream = error
        if isinstance(self._stream, CheckError):
            raise self._stream
        return self._stream

    @property
    def populated(self) -> list[int]:
        """Lanes on which a node answers. SkipError: there is none."""
        codes = self.stream.frames["lane"]["status"][SETTLE_TICKS:] >> STATUS_CODE_SHIFT
        nobody = (codes == CODES["absent"]) | (codes == CODES["lane_off"])
        return [lane for lane in range(LANES) if not nobody[:, lane].all()] or skip(NO_NODES)


@contextmanager
def daemon(rig: Rig, frames: int):
    """whiskerd on a ring of its own with room for so many frames, and a reader of it."""
    ring, capacity = f"whisker-hil-{os.getpid()}", 1 << max(frames - 1, 63).bit_length()
    words = [program("whiskerd"), "--ring", ring, "--ring-frames", capacity]
    with subprocess.Popen([str(word) for word in words], stderr=subprocess.PIPE, text=True) as process:
        try:
            with Reader(ring, wait_s=START_S) as reader:
                yield reader
        except RingError as error:
            process.terminate()
            raise CheckError(f"{error} {' / '.join(process.stderr.read().split(chr(10))[-3:])}".strip()) from error
        finally:
            process.terminate()
            process.communicate()
    require(process.returncode == 0, f"whiskerd ended with exit code {process.returncode}")


def await_frames(reader: Reader, count: int) -> None:
    """Until so many frames have been published in the ring."""
    text = f"no frame for {SILENCE_S:g} s; see whisker doctor"
    until(lambda: reader.info.published >= count, SILENCE_S, lambda: reader.info.published, text)


def take_stream(rig: Rig) -> Stream:
    """A run of whiskerd at its defaults. CheckError when no frames come or whiskerd fails."""
    count = SETTLE_TICKS + round(rig.seconds * TICKS_PER_S)
    with daemon(rig, 2 * count) as reader:
        await_frames(reader, count // 2)
        half = reader.clock
        await_frames(reader, count)
        stats, clock = reader.stats, reader.clock
        return Stream(reader.peek()[:count].copy(), stats, half, clock)
