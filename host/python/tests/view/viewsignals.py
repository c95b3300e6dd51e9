"""Frames of the demo's robot at signal level, on a drive that a picture is worth taking of."""

import asyncio
import time
from contextlib import asynccontextmanager

import numpy as np
from viewkit import spoil

from crunchbot.bridge.ring import FRAME, Writer
from crunchbot_lab.signals import World
from crunchbot_lab.simulation.scenes import make_scene
from whisker_protocol import CODES, LANES, LIMITS, STATUS_CODE_SHIFT

# m/s, rad/s, ticks; again and again
DRIVE = ((0.15, 0.0, 4000), (0.0, 0.71, 3000), (0.15, 0.0, 5000), (0.0, -0.71, 3000), (-0.15, 0.0, 3000))
BAD = 3000  # ticks between two bad records, about


def driven_frames(seed: int, ticks: int) -> np.ndarray:
    """So many frames of the demo's scene of this seed, some of their records bad."""
    scene, start = make_scene(seed)
    world, counts = World(scene.flat(start), seed), []
    while sum(map(len, counts)) < ticks:
        for v, omega, moved in DRIVE:
            world.drive(v, omega)
            counts.append(world.run(moved))
    read = np.concatenate(counts)[:ticks]
    frames = np.zeros(ticks, FRAME)
    frames["tick"] = frames["sequence"] = np.arange(ticks)
    frames["time_cycles"] = frames["tick"] * LIMITS["tick_period"]
    frames["lane_mask"] = (1 << LANES) - 1
    lanes = read.shape[1]
    frames["lane"]["alpha"][:, :lanes], frames["lane"]["beta"][:, :lanes] = read[:, :, 0], read[:, :, 1]
    frames["lane"]["status"][:, lanes:] = CODES["absent"] << STATUS_CODE_SHIFT
    rng = np.random.default_rng(seed)
    for tick in rng.integers(0, ticks, ticks // BAD):
        spoil(frames, "link_crc", rng.integers(lanes), slice(tick, tick + 1))
    return frames


@asynccontextmanager
async def in_time(writer: Writer, frames: np.ndarray):
    """While this lasts, these frames come when they would on a robot."""
    began, per_s = time.monotonic(), LIMITS["clock_hz"] / LIMITS["tick_period"]

    async def publish():
        done = 0
        while done < len(frames):
            due = round((time.monotonic() - began) * per_s)
            writer.publish(frames[done:due])
            done = due
            await asyncio.sleep(0.02)

    task = asyncio.create_task(publish())
    yield
    task.cancel()
