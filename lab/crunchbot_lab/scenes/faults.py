"""What goes wrong with rows that were right: every fault takes (observations, scene, rng) and returns observations."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from crunchbot.nav.observations import Observations
from crunchbot.scene import Arena, Scene

Fault = Callable[[Observations, Scene, np.random.Generator], Observations]

# What one cell of a broken frame holds: texture log-likelihood (inf: a bad cell, as a likelihood of zero reads too),
# distance in m (-inf: a bad cell).
BROKEN = {"zero": (np.inf, 0.0), "nan": (np.inf, np.nan), "inf": (np.inf, -np.inf), "constant": (0.0, 0.07)}
SECOND_ROWS, MINUTE_ROWS = 10, 600


def broken(kind: str, rows: int) -> Fault:
    """Every whisker's likelihoods are zero, NaN, infinite or constant for so many rows, a third of the way through."""
    texture, distance = BROKEN[kind]

    def fault(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
        first = len(o) // 3
        out = replace(o, texture=o.texture.copy(), radial_m=o.radial_m.copy())
        out.texture[first : first + rows] = texture
        out.radial_m[first : first + rows] = distance
        return out

    return fault


def silent(rows: int) -> Fault:
    """No whisker reads anything for so many rows, two fifths of the way through."""

    def fault(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
        first = 2 * len(o) // 5
        unread = (None if a is None else a.copy() for a in (o.texture, o.radial_m, o.normal))
        texture, radial, normal = unread
        for values in (texture, radial, normal):
            if values is not None:
                values[first : first + rows] = np.nan
        return replace(o, texture=texture, radial_m=radial, normal=normal)

    return fault


def renamed(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
    """From half-way on each texture is reported under the next one's name."""
    texture = o.texture.copy()
    texture[len(o) // 2 :] = np.roll(texture[len(o) // 2 :], 1, axis=2)
    return replace(o, texture=texture)


def dead(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
    """The first object whisker feels nothing; of a robot without, the first texture whisker always says the same."""
    out = replace(o, texture=o.texture.copy(), radial_m=o.radial_m.copy())
    if o.radial_m.shape[1]:
        out.radial_m[~np.isnan(o.radial_m[:, 0]), 0] = np.inf
    elif o.texture.shape[1]:
        out.texture[:, 0] = np.where(np.isnan(o.texture[:, 0]), np.nan, o.texture[0, 0])
    return out


def swapped(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
    """Cables of the first two object whiskers mixed up; of a robot with fewer, those of the texture whiskers."""
    out = replace(o, texture=o.texture.copy(), radial_m=o.radial_m.copy())
    if o.radial_m.shape[1] >= 2:
        out.radial_m[:, [0, 1]] = o.radial_m[:, [1, 0]]
    elif o.texture.shape[1] >= 2:
        out.texture[:, [0, 1]] = o.texture[:, [1, 0]]
    return out


def flipped(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
    """The first object whisker's deflection has the wrong sign: near contacts read as far and far ones as near."""
    out = replace(o, radial_m=o.radial_m.copy())
    for n, whisker in enumerate(scene.robot.of_role("object")[:1]):
        contact = np.isfinite(o.radial_m[:, n])
        out.radial_m[contact, n] = np.clip(whisker.length_m - o.radial_m[contact, n], 0.0, None)
    return out


def outliers(share: float) -> Fault:
    """So many of the contacts read any distance, so many of the windows any texture."""

    def fault(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
        out = replace(o, texture=o.texture.copy(), radial_m=o.radial_m.copy())
        for n, whisker in enumerate(scene.robot.of_role("object")):
            hit = np.isfinite(o.radial_m[:, n]) & (rng.random(len(o)) < share)
            out.radial_m[hit, n] = rng.uniform(0.0, whisker.length_m, int(hit.sum()))
        for n in range(o.texture.shape[1]):
            hit = rng.random(len(o)) < share
            out.texture[hit, n] = rng.permuted(o.texture[hit, n], axis=1)
        return out

    return fault


def missed(share: float) -> Fault:
    """So many of the contacts are not noticed."""

    def fault(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
        lost = np.isfinite(o.radial_m) & (rng.random(o.radial_m.shape) < share)
        return replace(o, radial_m=np.where(lost, np.inf, o.radial_m))

    return fault


def _taken(o: Observations, rows: np.ndarray) -> Observations:
    truth = None if o.truth is None else o.truth[rows]
    text = [o.t_text[k] for k in rows] if o.t_text else []
    touched = (None if a is None else a[rows] for a in (o.normal, o.point))
    own = None if o.own is None else o.own[rows]
    return Observations(o.t_s[rows], text, o.odometry[rows], o.texture[rows], o.radial_m[rows], truth, own, *touched)


def late(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
    """One row in fifty comes three rows late."""
    due = np.arange(len(o)) + np.where(rng.random(len(o)) < 0.02, 3.5, 0.0)
    return _taken(o, np.argsort(due, kind="stable"))


def doubled(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
    """One row in twenty comes twice."""
    return _taken(o, np.repeat(np.arange(len(o)), np.where(rng.random(len(o)) < 0.05, 2, 1)))


def reordered(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
    """One row in twenty changes places with the next."""
    due = np.arange(len(o)) + np.where(rng.random(len(o)) < 0.05, 1.5, 0.0)
    return _taken(o, np.argsort(due, kind="stable"))


def dropped(o: Observations, scene: Scene, rng: np.random.Generator) -> Observations:
    """One row in ten never comes, its odometry with it."""
    keep = rng.random(len(o)) >= 0.1
    keep[0] = True
    return _taken(o, np.nonzero(keep)[0])


def wrong_tile(arena: Arena, rng: np.random.Generator) -> Arena:
    """The map as the filters get it: one tile has another texture."""
    rows = [list(row) for row in arena.floor]
    row, column = rng.integers(len(rows)), rng.integers(len(rows[0]))
    others = [name[0] for name in arena.textures if name[0] != rows[row][column]]
    rows[row][column] = others[rng.integers(len(others))] if others else rows[row][column]
    return replace(arena, floor=tuple("".join(line) for line in rows))


def lost_obstacle(arena: Arena, rng: np.random.Generator) -> Arena:
    """The map as the filters get it: one obstacle is missing."""
    if not arena.obstacles:
        return arena
    gone = int(rng.integers(len(arena.obstacles)))
    return replace(arena, obstacles=tuple(box for n, box in enumerate(arena.obstacles) if n != gone))
