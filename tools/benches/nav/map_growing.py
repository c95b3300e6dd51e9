"""A picture: one map as it grows, from rows of touch alone."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from crunchbot.nav.mapper import Mapper, TouchMap
from crunchbot.scene import Arena
from crunchbot_lab.scenes import map_scoring
from crunchbot_lab.scenes.making import ROW_S, make

FAMILY, SEED = "anchor", 500
ROWS = (100, 300, 1000, 3000)  # after which it is drawn
MARGIN_M = 0.15
EVERY = 3  # rows between two points of a path
LIKELY = 0.5  # probability from which a cell is not free


def figure() -> Figure:
    """Four moments of a run, in the frame of the arena."""
    made = make(FAMILY, SEED, ROWS[-1])
    arena, truth = made.scene.arena, made.observations.truth
    mapper = Mapper(made.scene.robot, arena.textures)
    drawn = Figure(figsize=(10.4, 3.3), layout="constrained")
    path, first = np.zeros((0, 3)), None
    for ax, rows in zip(drawn.subplots(1, len(ROWS)), ROWS, strict=True):
        table, _ = mapper.replay(made.observations, len(path), rows - len(path))
        path = np.concatenate([path, table["pose"]])
        first = first or map_scoring.first_motion(path, truth)
        _draw(ax, arena, mapper.map(), first)
        ax.plot(*truth[:rows:EVERY, :2].T, color="0.55", linestyle=":", linewidth=0.6)
        ax.plot(*first.points(path[::EVERY, :2]).T, color="black", linewidth=0.5)
        ax.set_title(f"after {rows * ROW_S:.0f} s", fontsize=9)
    drawn.axes[0].set_ylabel("m", fontsize=8)
    return drawn


def _draw(ax: Axes, arena: Arena, known: TouchMap, motion: map_scoring.Motion) -> None:
    """What is believed (cells, faces, corners) over the true walls."""
    width, height = arena.size_m
    grid = known.grid
    if grid is not None:
        rows, columns = grid.occupied.shape
        x, y = np.meshgrid(grid.x + grid.cell * np.arange(columns + 1), grid.y + grid.cell * np.arange(rows + 1))
        at = motion.points(np.column_stack([x.ravel(), y.ravel()])).T.reshape(2, *x.shape)
        free = np.where(grid.occupied < LIKELY, 0.9, 1.0)
        ax.pcolormesh(*at, free, cmap="gray", vmin=0.0, vmax=1.0, rasterized=True)
    faces = known.faces
    ends = [motion.points(np.array([[f["x0"], f["y0"]], [f["x1"], f["y1"]]])) for f in faces]
    ax.add_collection(LineCollection(ends, colors="black", linewidths=2.2))
    ax.plot(
        *motion.points(np.column_stack([known.corners["x"], known.corners["y"]])).T,
        "o",
        color="black",
        mfc="white",
        ms=4,
    )
    for x0, y0, x1, y1 in ((0.0, 0.0, width, height), *arena.obstacles):
        ax.plot([x0, x1, x1, x0, x0], [y0, y0, y1, y1, y0], color="0.6", linestyle="--", linewidth=0.8)
    ax.set(xlim=(-MARGIN_M, width + MARGIN_M), ylim=(-MARGIN_M, height + MARGIN_M), aspect="equal")
    ax.tick_params(labelsize=7)
