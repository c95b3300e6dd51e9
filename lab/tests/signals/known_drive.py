"""A simulated robot that wanders over known tiles, recorded as `whisker record` and a base's odometry leave it."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from crunchbot import scene as scenes
from crunchbot.bridge.ring import FRAME
from crunchbot.recording.messages import encode_block
from crunchbot.recording.writing import RecordingWriter
from crunchbot.scene import Prior, Scene
from crunchbot_lab.signals.world import TICK_S, World
from crunchbot_lab.simulation.scenes import make_scene, simulated

CYCLES = 30_000  # of the bridge's clock in a tick
ROW_TICKS = 200
TURN_RAD_S = 0.6
CLEAR_M = 0.4  # of walls, at which it turns about


def floor_scene(batch: int, seed: int = 1) -> Scene:
    """The demo's arena without blocks, its robot without object whiskers."""
    scene, _ = make_scene(seed)
    robot = replace(scene.robot, whiskers=tuple(scene.robot.of_role("texture")))
    arena = replace(scene.arena, obstacles=())
    return replace(scene, arena=arena, robot=robot, simulated=simulated("static", batch))


def wander(scene: Scene, seed: int, seconds: float, speed_m_s: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Counts (n, lanes, 2) uint16; a row each 0.1 s: true pose at its end, and odometry in it. The first pose is the start."""
    rng = np.random.default_rng(seed)
    start = (0.6, 0.6, float(rng.uniform(0.0, math.pi / 2.0)))
    world, side = World(scene.flat(start), seed), np.array(scene.arena.size_m)
    counts, poses, odometry, turn_s = [], [start], [], 0.0
    for _ in range(round(seconds / TICK_S) // ROW_TICKS):
        x, y, theta = world.pose
        ahead = np.array([x, y]) + 0.05 * np.array([math.cos(theta), math.sin(theta)])
        if turn_s <= 0.0 and (np.minimum(ahead, side - ahead) < CLEAR_M).any():
            turn_s = float(rng.uniform(2.0, 4.5))
        leaving = (np.minimum(ahead, side - ahead) >= np.minimum([x, y], side - np.array([x, y]))).all()
        turning = turn_s > 0.0 or ((np.minimum(ahead, side - ahead) < CLEAR_M).any() and not leaving)
        world.drive(0.0 if turning else speed_m_s, TURN_RAD_S if turning else 0.0)
        turn_s -= ROW_TICKS * TICK_S
        counts.append(world.run(ROW_TICKS))
        odometry.append(world.odometry())
        poses.append(world.pose)
    return np.concatenate(counts), np.array(poses), np.array(odometry)


def frames_of(counts: np.ndarray, first_tick: int = 0) -> np.ndarray:
    """Frames of these counts, whole and without a bad reading."""
    frames = np.zeros(len(counts), FRAME)
    frames["tick"] = first_tick + np.arange(len(counts))
    frames["time_cycles"] = CYCLES * frames["tick"]
    frames["sequence"] = np.arange(len(counts))
    frames["lane_mask"] = (1 << counts.shape[1]) - 1
    frames["lane"]["alpha"][:, : counts.shape[1]] = counts[..., 0]
    frames["lane"]["beta"][:, : counts.shape[1]] = counts[..., 1]
    return frames


def record(path: Path, counts: np.ndarray, first_tick: int = 0) -> None:
    """An MCAP file of these counts."""
    frames = frames_of(counts, first_tick)
    writer = RecordingWriter(path, {})
    for start in range(0, len(frames), ROW_TICKS):
        writer.block(10**9 + start * 500_000, encode_block(frames[start : start + ROW_TICKS]))
    writer.finish({"frames": str(len(frames))})


def write_scene(folder: Path, scene: Scene, start: np.ndarray, odometry: np.ndarray) -> None:
    """The scene folder of a robot that has no texture model yet: odometry, nothing read of the floor."""
    prior = Prior("gaussian", tuple(map(float, start)), (0.005, 0.005, 0.01))
    scenes.write(folder, replace(scene, prior=prior))
    names = ",".join(scene.layout.names)
    lines = [f"t_s,odo_x_m,odo_y_m,odo_theta_rad,{names}"]
    empty = "," * len(scene.layout.names)
    lines += [f"{0.1 * (n + 1):.1f},{x:.6f},{y:.6f},{t:.6f}{empty}" for n, (x, y, t) in enumerate(odometry)]
    (folder / "observations.csv").write_text("\n".join(lines) + "\n")


def write_way(path: Path, poses: np.ndarray) -> None:
    rows = [f"{0.1 * n:.1f},{x:.4f},{y:.4f},{t:.5f}" for n, (x, y, t) in enumerate(poses)]
    path.write_text("t_s,x_m,y_m,theta_rad\n" + "\n".join(rows) + "\n")
