"""Proves FPGA, FIFO and USB of a bridge without a node: it fills its frames with a pattern, and every sample is compared."""

import os
import subprocess
import time

import numpy as np

from whisker_protocol import LANES

from .ring import Reader, RingError

START_S = 10.0  # until whiskerd has its ring, and between two frames
LOOK_S = 0.1  # how soon it is noticed that whiskerd has ended
END_S = 15.0  # for it to stop


class PatternError(Exception):
    """The bridge could not be asked; the text is one line."""


def expected(tick: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """alpha and beta (n, lanes) of the pattern at ticks (n,), as `control_options` of the protocol defines it."""
    lane, low = 256 * np.arange(LANES)[None, :], (tick % 256).astype(np.int64)[:, None]
    return 0x8000 + lane + 255 - low, 0x4000 + lane + low


def wrong(frames: np.ndarray) -> list[str]:
    """What of these frames (n,) is not the pattern, a line each; lanes outside the lane mask are left out."""
    alpha, beta = expected(frames["tick"])
    lanes = frames["lane"]
    bad = (lanes["alpha"] != alpha) | (lanes["beta"] != beta) | (lanes["status"] != 0)
    bad &= (frames["lane_mask"][:, None] >> np.arange(LANES)[None, :] & 1).astype(bool)
    out = [f"lane {lane}: {n} of {len(frames)} samples are not the pattern" for lane, n in enumerate(bad.sum(0)) if n]
    lost = int((np.diff(frames["sequence"].astype(np.int64)) - 1).clip(0).sum())
    return out + ([f"{lost} frames were lost"] if lost else [])


def record(whiskerd: str, serial: str | None, count: int) -> np.ndarray:
    """The first `count` frames of a run with the pattern, by way of a ring of its own; PatternError if they do not come."""
    ring = f"whisker-doctor-{os.getpid()}"
    words = [whiskerd, "--ring", ring, "--pattern", "--once", *(["--serial", serial] if serial else [])]
    frames, trouble = None, ""
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as daemon:
        try:
            frames = _read(_attached(ring, daemon), count)
        except RingError as error:
            trouble = str(error)
        daemon.terminate()
        reported = daemon.communicate(timeout=END_S)[1].strip().splitlines()
    if frames is None or daemon.returncode != 0:
        raise PatternError(reported[-1] if reported else trouble)
    return frames


def _attached(ring: str, daemon: subprocess.Popen) -> Reader:
    """A reader, as soon as there is a ring; RingError when the daemon has ended, or takes too long."""
    end = time.monotonic() + START_S
    while True:
        try:
            return Reader(ring, LOOK_S)
        except RingError:
            if daemon.poll() is not None or time.monotonic() > end:
                raise


def _read(reader: Reader, count: int) -> np.ndarray:
    kept, have = [], 0
    with reader:
        while have < count:
            frames = reader.take(START_S)
            if frames is None or len(frames) == 0:
                raise RingError(f"ring {reader.name}: no frame in {START_S:g} s; see whiskerd's log")
            kept.append(frames)
            have += len(frames)
    return np.concatenate(kept)[:count]
