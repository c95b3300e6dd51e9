"""Tracks on two layers of a small board: A* on a grid; a net without a way displaces others, which then look for another.

Owner maps say who may use a cell: 0 nobody yet, n net n and nobody else, -1 nobody at all. There is one map per layer for
every width of track and for vias, in which all copper is grown by what a track of that width must keep away from it.
"""

import heapq
from collections import deque
from dataclasses import dataclass

import numpy as np

BLOCKED = -1
STRAIGHT, DIAGONAL, VIA, TURN = 10, 14, 130, 4
BACK = 2  # the back is the ground plane: a step there costs this much more
MOVES = [(dx, dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1) if dx or dy]
FIGHT, FOUGHT = 60, 40  # price of a cell that another net holds, and what it rises by each time
ROUNDS = 8  # attempts per net, on average


@dataclass(frozen=True)
class Rules:
    """Millimetres: grid's step, clearance between copper, copper to edge, via's copper and hole."""

    step: float = 0.127
    clearance: float = 0.2
    edge: float = 0.4
    via: float = 0.6
    hole: float = 0.3


@dataclass(frozen=True)
class Pad:
    """Copper to be reached: a box x0, y0, x1, y1 in mm on some of the layers 0 (front) and 1 (back)."""

    net: int
    x: float
    y: float
    box: tuple[float, float, float, float]
    layers: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Task:
    """Pads of one net that are to be joined; ground: only a way from each pad to the plane on the back."""

    net: int
    pads: tuple[Pad, ...]
    width: float
    ground: bool = False


class Router:
    """Routes the tasks of one board; `tracks` are (net, layer, points in mm, width), `vias` (net, x, y)."""

    def __init__(self, outline, pads, holes, widths, rules):
        self.rules, self.outline = rules, outline
        self.nx = int((outline[2] - outline[0]) / rules.step) + 1
        self.ny = int((outline[3] - outline[1]) / rules.step) + 1
        self.half = {f"{width}": width / 2 for width in widths} | {"via": rules.via / 2}
        self.base = {name: np.zeros((2, self.ny, self.nx), np.int16) for name in self.half}
        self.maps = self.base
        for name, half in self.half.items():
            margin = int(np.ceil((rules.edge + half) / rules.step))
            for cut in (np.s_[:, :margin], np.s_[:, -margin:], np.s_[:, :, :margin], np.s_[:, :, -margin:]):
                self.base[name][cut] = BLOCKED
        for pad in pads:
            self.mark(pad.net, pad.layers, pad.box)
        for pad in pads:
            if len(pad.layers) == 1:  # no via in a pad that is soldered with paste: it would drink the solder
                self.no_via(pad.box)
        for x, y, radius in holes:
            self.mark(BLOCKED, (0, 1), (x, y, x, y), radius)
        self.maps = {name: array.copy() for name, array in self.base.items()}

    def cell(self, x, y):
        """Column and row of the cell nearest to a point in mm."""
        step = self.rules.step
        return round((x - self.outline[0]) / step), round((y - self.outline[1]) / step)

    def point(self, ix, iy):
        """Middle of a cell, mm."""
        return self.outline[0] + ix * self.rules.step, self.outline[1] + iy * self.rules.step

    def no_via(self, box):
        """Keeps all vias out of a box and off its edge."""
        reach = self.rules.via / 2 + 0.05
        (x0, y0), (x1, y1) = self.cell(box[0] - reach, box[1] - reach), self.cell(box[2] + reach, box[3] + reach)
        self.base["via"][:, max(y0, 0) : y1 + 1, max(x0, 0) : x1 + 1] = BLOCKED

    def mark(self, net, layers, box, radius=0.0):
        """Copper of a net: everything within `radius` of the box."""
        self.mark_segment(net, layers, (box[0], box[1]), (box[2], box[3]), radius, box)

    def mark_segment(self, net, layers, a, b, radius, box=None):
        """Copper of a net: within `radius` of the segment a, b, or of a box."""
        for name, half in self.half.items():
            reach = radius + self.rules.clearance + half - 1e-6
            lo = self.cell(min(a[0], b[0]) - reach, min(a[1], b[1]) - reach)
            hi = self.cell(max(a[0], b[0]) + reach, max(a[1], b[1]) + reach)
            x0, y0 = max(lo[0], 0), max(lo[1], 0)
            x1, y1 = min(hi[0] + 1, self.nx), min(hi[1] + 1, self.ny)
            if x0 >= x1 or y0 >= y1:
                continue
            gx, gy = np.meshgrid(np.arange(x0, x1), np.arange(y0, y1))
            px, py = self.point(gx, gy)
            near = (to_box(px, py, box) if box else to_segment(px, py, a, b)) < reach
            for layer in layers:
                view = self.maps[name][layer, y0:y1, x0:x1]
                mine = near & ((view == 0) | (view == net))
                view[near & ~mine] = BLOCKED
                view[mine] = net

    def route(self, tasks):
        """Routes all; a net that finds no way takes one through others, and these look for another one afterwards. Returns
        the nets that are left without a way."""
        waiting, self.done = deque(tasks), {}
        self.fought = np.zeros(2 * self.ny * self.nx, np.int32)
        for _ in range(ROUNDS * len(tasks)):
            if not waiting:
                break
            task = waiting.popleft()
            if self.attempt(task, force=False):
                continue
            if not self.attempt(task, force=True):
                return [task.net]
            victims = [other for other in self.done if other is not task and self.collide(task, other)]
            for other in victims:
                del self.done[other]
            waiting.extend(victims)
            self.redraw()
        return [task.net for task in waiting]

    @property
    def tracks(self):
        return [track for tracks, _ in self.done.values() for track in tracks]

    @property
    def vias(self):
        return [via for _, vias in self.done.values() for via in vias]

    def attempt(self, task, force):
        """Routes one task; nothing is left of it if it fails."""
        self.done[task] = ([], [])
        if self.join(task, force):
            return True
        del self.done[task]
        self.redraw()
        return False

    def redraw(self):
        """The maps anew from pads and what is routed."""
        self.maps = {name: array.copy() for name, array in self.base.items()}
        for tracks, vias in self.done.values():
            for net, layer, corners, width in tracks:
                for a, b in zip(corners, corners[1:], strict=False):
                    self.mark_segment(net, (layer,), a, b, width / 2)
            for net, x, y in vias:
                self.mark(net, (0, 1), (x, y, x, y), self.rules.via / 2)

    def collide(self, task, other):
        """Whether copper of two tasks of different nets is too near."""
        if task.net == other.net:
            return False
        mine, its = list(self.pieces(task)), list(self.pieces(other))
        return any(layer == layer2 and apart(a, b, a2, b2) < half + half2 + self.rules.clearance - 1e-6
                   for layer, a, b, half in mine for layer2, a2, b2, half2 in its)  # fmt: skip

    def pieces(self, task):
        """Copper of a task: (layer, end, end, half the width), mm."""
        tracks, vias = self.done[task]
        for _, layer, corners, width in tracks:
            for a, b in zip(corners, corners[1:], strict=False):
                yield layer, a, b, width / 2
        for _, x, y in vias:
            for layer in (0, 1):
                yield layer, (x, y), (x, y), self.rules.via / 2

    def join(self, task, force):
        """Joins all pads of a task; whether it could be done."""
        if task.ground:
            return all(self.connect(task, [pad], None, None, force) for pad in task.pads)
        tree, todo = [task.pads[0]], list(task.pads[1:])
        points = []
        while todo:
            reached = self.connect(task, tree, todo, points, force)
            if reached is None:
                return False
            tree.append(reached)
            todo.remove(reached)
        return True

    def connect(self, task, sources, targets, points, force):
        """One way from what is joined already to the nearest of the targets; None if there is none. With force it may lead
        through other nets' tracks, never through pads; where nets met before it costs more each time."""
        name = f"{task.width}"
        maps = self.base if force else self.maps
        free = np.isin(maps[name], (0, task.net)).ravel().tobytes()
        room = np.isin(maps["via"], (0, task.net))
        via = (room[0] & room[1]).ravel().tobytes()
        extra = None
        if force:
            taken = ~np.isin(self.maps[name], (0, task.net)).ravel()
            extra = (taken * FIGHT + self.fought).tolist()
        size = self.nx * self.ny
        starts = {layer * size + self.index(pad) for pad in sources for layer in pad.layers} | set(points or [])
        goals = {layer * size + self.index(pad): pad for pad in targets or [] for layer in pad.layers}
        way = self.search(free, via, starts, goals, extra)
        if way is None:
            return None
        if force:
            fights = np.array(way)[taken[way]]
            self.fought[fights] += FOUGHT
        self.keep(task, way, sources, goals.get(way[-1]))
        if points is not None:
            points.extend(way)
        return goals.get(way[-1], True)

    def index(self, pad):
        """Number of the front cell nearest to a pad's middle."""
        ix, iy = self.cell(pad.x, pad.y)
        return iy * self.nx + ix

    def search(self, free, via, starts, goals, extra):
        """Cheapest way of cells from a start to a goal, to any cell of the back if there are no goals; None if there is none.
        free, via: whether a track, a via may stand in a cell; extra: what entering a cell costs besides, or None."""
        guess, size = self.guess(goals), self.nx * self.ny
        best = dict.fromkeys(starts, 0)
        came: dict[int, int] = {}
        heads: dict[int, tuple | None] = {}
        queue = [(guess(cell), cell) for cell in sorted(starts)]
        heapq.heapify(queue)
        done = set()
        while queue:
            _, cell = heapq.heappop(queue)
            if cell in done:
                continue
            done.add(cell)
            if cell in goals or (not goals and cell >= size):
                return traced(came, cell)
            for other, price, head in self.steps(cell, heads.get(cell), free, via):
                total = best[cell] + price + (extra[other] if extra else 0)
                if total < best.get(other, 1 << 60):
                    best[other], came[other], heads[other] = total, cell, head
                    heapq.heappush(queue, (total + guess(other), other))
        return None

    def guess(self, goals):
        """A lower bound of what it costs to get from a cell to the goals, as a function of the cell."""
        nx, size = self.nx, self.nx * self.ny
        if not goals:
            return lambda cell: 0
        columns, rows = [goal % size % nx for goal in goals], [goal % size // nx for goal in goals]
        x0, x1, y0, y1 = min(columns), max(columns), min(rows), max(rows)

        def bound(cell):
            x, y = cell % size % nx, cell % size // nx
            dx, dy = max(x0 - x, 0, x - x1), max(y0 - y, 0, y - y1)
            return STRAIGHT * max(dx, dy) + (DIAGONAL - STRAIGHT) * min(dx, dy)

        return bound

    def steps(self, cell, head, free, via):
        """Cells beside a cell, or under it, that may be entered from it with heading `head`: (cell, price, new heading)."""
        size = self.nx * self.ny
        for dx, dy in MOVES:
            other = cell + dx + dy * self.nx
            ahead = head[0] * dx + head[1] * dy if head else 1
            if free[other] and ahead > 0:  # no corner of 90 degrees or sharper
                price = DIAGONAL if dx and dy else STRAIGHT
                yield (
                    other,
                    (price * BACK if cell >= size else price) + (TURN if head not in (None, (dx, dy)) else 0),
                    (dx, dy),
                )
        other = cell - size if cell >= size else cell + size
        if via[cell % size] and free[other]:
            yield other, VIA, None

    def keep(self, task, way, sources, target):
        """Turns a way into tracks and vias, and marks them."""
        size = self.nx * self.ny
        runs: list[tuple[int, list]] = []
        for cell in way:
            layer, spot = cell // size, self.point(cell % size % self.nx, cell % size // self.nx)
            if runs and runs[-1][0] == layer:
                runs[-1][1].append(spot)
                continue
            if runs:
                self.done[task][1].append((task.net, *spot))
                self.mark(task.net, (0, 1), (*spot, *spot), self.rules.via / 2)
            runs.append((layer, [spot]))
        first = next((pad for pad in sources if self.index(pad) == way[0] % size), None)
        if first:
            runs[0][1].insert(0, (first.x, first.y))
        if target:
            runs[-1][1].append((target.x, target.y))
        for layer, spots in runs:
            corners = straightened(spots)
            if len(corners) > 1:
                self.done[task][0].append((task.net, layer, corners, task.width))
            for a, b in zip(corners, corners[1:], strict=False):
                self.mark_segment(task.net, (layer,), a, b, task.width / 2)

    def stitch(self, net, pitch):
        """Vias of the ground net wherever there is room for one, at least `pitch` mm apart."""
        task = Task(net, (), 0.0)
        self.done[task] = ([], [])
        half = pitch / 2
        for y in np.arange(self.outline[1] + half, self.outline[3], pitch):
            for x in np.arange(self.outline[0] + half, self.outline[2], pitch):
                ix, iy = self.cell(x, y)
                if all(self.maps["via"][layer, iy, ix] == 0 for layer in (0, 1)):
                    spot = self.point(ix, iy)
                    self.done[task][1].append((net, *spot))
                    self.mark(net, (0, 1), (*spot, *spot), self.rules.via / 2)


def traced(came, cell):
    """The way that led to a cell, from its start."""
    way = [cell]
    while way[-1] in came:
        way.append(came[way[-1]])
    return way[::-1]


def straightened(points):
    """The corners of a run of points: points in the middle of a straight piece are left out."""
    kept = [points[0]]
    for point in points[1:]:
        if abs(point[0] - kept[-1][0]) < 1e-6 and abs(point[1] - kept[-1][1]) < 1e-6:
            continue
        if len(kept) > 1:
            a, b = kept[-2], kept[-1]
            cross = (b[0] - a[0]) * (point[1] - b[1]) - (b[1] - a[1]) * (point[0] - b[0])
            if abs(cross) < 1e-9:
                kept.pop()
        kept.append(point)
    return kept


def apart(a, b, c, d) -> float:
    """Distance between two segments, mm; 0 where they cross."""

    def side(p, q, r):
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    if side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0:
        return 0.0
    return float(min(to_segment(c[0], c[1], a, b), to_segment(d[0], d[1], a, b),
                     to_segment(a[0], a[1], c, d), to_segment(b[0], b[1], c, d)))  # fmt: skip


def to_box(px, py, box):
    """Distance of points from a box, mm."""
    dx = np.maximum(np.maximum(box[0] - px, px - box[2]), 0)
    dy = np.maximum(np.maximum(box[1] - py, py - box[3]), 0)
    return np.hypot(dx, dy)


def to_segment(px, py, a, b):
    """Distance of points from a segment, mm."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = dx * dx + dy * dy
    t = np.clip(((px - a[0]) * dx + (py - a[1]) * dy) / length, 0, 1) if length else 0
    return np.hypot(px - a[0] - t * dx, py - a[1] - t * dy)
