"""The topics of the robot's part of the page: scene, robot, belief, map. Reference: docs/view.md."""

import json
import struct
import time
from dataclasses import asdict, replace

from ..occupancy import NOWHERE
from .hub import Hub
from .robot import RobotModel

ROBOT_S = 0.1  # between two messages of topic robot
BELIEF_S, MAP_S = 0.25, 0.5
POINTS_MOST = 500  # of a path in one message: a history comes in several
BELIEF_HEAD = struct.Struct("<BBHIdd")  # topic, zero, poses, poses in the whole belief, stamp s, share of those sent
BELIEF_ID = 6


class SceneFeed:
    """Arena and robot of the scene, as JSON, once."""

    def __init__(self, hub: Hub, options: dict):
        self._model, self._reported = hub.robot, False

    def take(self) -> str | None:
        if self._reported:
            return None
        self._reported = True
        scene = self._model.scene
        reported = {
            "arena": None,
            "origin": NOWHERE,
            "robot": None,
            "text": "arena not known: start whisker-view with --scene SCENE",
        }
        if scene is not None:
            robot = asdict(replace(scene.robot, sensors=()))
            reported = {"arena": asdict(scene.arena), "origin": scene.origin, "robot": robot, "text": ""}
        return json.dumps({"topic": "scene"} | reported, separators=(",", ":"))

    def close(self) -> None:
        return


class RobotFeed:
    """What is known of the robot, as JSON, ten times a second: at first all parts, then those that have changed."""

    def __init__(self, hub: Hub, options: dict):
        self._hub, self._model = hub, hub.robot
        self._due, self._run = 0.0, None
        self._reported: dict[str, str] = {}
        self._next = {"path": 0, "true_path": 0}
        hub.robot_watchers += 1
        hub.source.look()

    def take(self) -> str | None:
        now = time.monotonic()
        if now < self._due:
            return None
        changed = self._changed(_parts(self._hub))
        points = self._points()
        if not changed and not points:
            return None
        self._due = now + ROBOT_S
        body = [f'"{name}":{value}' for name, value in (changed | points).items()]
        return f'{{"topic":"robot",{",".join(body)}}}'

    def _changed(self, parts: dict) -> dict[str, str]:
        """JSON of the parts that are not as last sent."""
        texts = {name: json.dumps(part, separators=(",", ":"), allow_nan=False) for name, part in parts.items()}
        changed = {name: part for name, part in texts.items() if self._reported.get(name) != part}
        self._reported = texts
        return changed

    def _points(self) -> dict[str, str]:
        """JSON of what is new of the paths; `begin`: forget what came before."""
        fresh = self._run != self._model.run
        if fresh:
            self._run, self._next = self._model.run, dict.fromkeys(self._next, 0)
        reported = {}
        for name, number in self._next.items():
            first, points = getattr(self._model, name).since(number, POINTS_MOST)
            self._next[name] = first + len(points)
            if points or fresh:
                reported[name] = json.dumps({"begin": fresh, "points": points}, separators=(",", ":"))
        return reported

    def close(self) -> None:
        self._hub.robot_watchers -= 1


def _parts(hub: Hub) -> dict:
    model: RobotModel = hub.robot
    heard = model.age()
    return {
        "run": model.run,
        "name": hub.source.name,
        "link": hub.source.link(),
        "playback": hub.source.playback(),
        "refused": hub.source.refused(),
        "heard_s": None if heard is None else round(heard, 1 if heard < 2 else 0),
        "now_s": None if model.now_s is None else round(model.now_s, 1),
        "ages": {name: _age(model, name) for name in ("pose", "observation", "truth", "belief")},
        "unread_s": None if model.unread_s() is None else round(model.unread_s()),
        "pose": model.pose,
        "filters": list(model.filters.values()),
        "truth": model.truth,
        "behaviour": model.behaviour,
        "row": model.row,
        "rows": model.rows,
        "touching": model.touching(),
        "contacts": list(model.contacts.values()),
        "surfaces": list(model.surfaces.reported),
        "processes": model.health(),
    }


def _age(model: RobotModel, name: str) -> float | None:
    age = model.age("localisation" if name == "pose" else name)
    return None if age is None else round(age, 1 if age < 2 else 0)


class BeliefFeed:
    """The newest belief: weighted poses with their widths, as binary; older ones that a page had no time for are dropped."""

    def __init__(self, hub: Hub, options: dict):
        self._model, self._reported, self._due = hub.robot, None, 0.0

    def take(self) -> bytes | None:
        belief, now = self._model.belief, time.monotonic()
        if belief is None or belief is self._reported or now < self._due:
            return None
        self._reported, self._due = belief, now + BELIEF_S
        poses = self._model.belief_columns()
        head = BELIEF_HEAD.pack(BELIEF_ID, 0, len(poses), belief.components, belief.header.stamp.ns / 1e9, belief.mass)
        return head + poses.tobytes()

    def close(self) -> None:
        return


class MapFeed:
    """The newest map of a mapper, as JSON; null when a run without one has begun."""

    def __init__(self, hub: Hub, options: dict):
        self._model, self._reported, self._due = hub.robot, None, 0.0

    def take(self) -> str | None:
        newest, now = (self._model.touched, self._model.grid), time.monotonic()
        if newest == (self._reported or (None, None)) or now < self._due:
            return None
        self._reported, self._due = newest, now + MAP_S
        return json.dumps({"topic": "map", "map": self._model.map()}, separators=(",", ":"), allow_nan=False)

    def close(self) -> None:
        return
