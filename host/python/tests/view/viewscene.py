"""A drawn scene as the robot's messages, with the estimates and the belief that a filter really has of it."""

from dataclasses import replace
from functools import partial

import numpy as np
from viewrobot import ROW_NS

from whisker.nav.filters import Filter
from whisker.pilot.pilot import compose
from whisker.robot.belief import condense, to_message
from whisker.robot.messages import (
    EMPTY,
    EXPLORING,
    NOT_READ,
    SHAFT,
    TIP,
    VALUE,
    Behaviour,
    Contact,
    Header,
    KeyValue,
    Localisation,
    Observation,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    ProcessHealth,
    Time,
)
from whisker.scenes import arenas
from whisker.scenes.families import Recipe, recipe
from whisker.scenes.making import make_recipe

FILTER = "adaptive"
ALIKE = replace(recipe("robot+global"), arena=arenas.symmetric(2))  # the demo's robot where half a turn changes nothing


class SceneRun:
    """`messages(row)` gives what is sent for a row; ask for each row once, in order."""

    def __init__(self, recipe: Recipe, seed: int, rows: int):
        made = make_recipe(recipe, seed, rows)
        self.scene, self._rows = made.scene, made.observations
        self._filter = Filter(FILTER, self.scene, seed=seed)
        self._pose = np.zeros(3)
        self._rays = [ray.name for ray in self.scene.robot.of_role("object")]
        tips = [tip.name for tip in self.scene.robot.of_role("texture")]
        self._names = [f"{tip}_{texture}" for tip in tips for texture in self.scene.arena.textures]
        self._names += [f"{ray}_mm" for ray in self._rays]
        self._onset: dict[int, int] = {}

    def messages(self, row: int) -> list[tuple[str, object]]:
        """(topic, message) in the order they are sent."""
        estimate, _ = self._filter.replay(self._rows, row, 1)
        at = partial(Header.at, row * ROW_NS)
        pose = PoseWithCovariance.planar(estimate[0]["pose"], estimate[0]["covariance"])
        told = [("observation", self._observation(row))]
        confidence = float(estimate[0]["confidence"])
        told.append(("localisation", Localisation(at("arena"), FILTER, pose, confidence, row, prior="uniform")))
        told.append(("truth", PoseStamped(at("arena"), Pose.planar(*self._rows.truth[row]))))
        told += [("contact", contact) for ray in range(len(self._rays)) for contact in self._contact(row, ray)]
        if row % 5 == 0:
            bumps = self._filter.components()
            told.append(("belief", to_message(at("arena"), FILTER, row, len(bumps), condense(bumps))))
        if row % 10 == 0:
            counts = [KeyValue("rows", str(row)), KeyValue("states", str(estimate[0]["states"]))]
            told.append(("health/pilot", ProcessHealth(at(), "pilot", 4005, "running", counts[:1])))
            told.append(("health/navigator", ProcessHealth(at(), "navigator", 4009, "running", counts)))
        if row == 0:
            told.append(("behaviour", Behaviour(at(), "EXPLORE", Time(), "replayed from a drawn scene")))
        return told

    def _observation(self, row: int) -> Observation:
        texture, radial = self._rows.texture[row].ravel(), 1e3 * self._rows.radial_m[row]
        cells = np.where(np.isnan(texture), EMPTY, VALUE)
        cells = np.append(cells, np.select([np.isnan(radial), np.isinf(radial)], [NOT_READ, EMPTY], VALUE))
        values = np.where(cells == VALUE, np.append(texture, radial), 0.0)
        motion = self._rows.odometry[row]
        self._pose = compose(self._pose, motion)
        return Observation(
            Header.at(row * ROW_NS), row, EXPLORING, motion, self._pose, self._names, cells.astype(np.uint8), values
        )

    def _contact(self, row: int, ray: int) -> list[Contact]:
        """A touch that begins, measured at once, or that is over."""
        radius, header = float(self._rows.radial_m[row, ray]), Header.at(row * ROW_NS)
        name, whisker = self._rays[ray], self.scene.robot.of_role("object")[ray]
        if not np.isfinite(radius):
            began = self._onset.pop(ray, None)
            over = began is not None
            return [Contact(header, name, False, Time.of(began * ROW_NS), Time.of(row * ROW_NS))] if over else []
        if ray in self._onset:
            return []
        self._onset[ray] = row
        part = TIP if radius > 0.6 * whisker.length_m else SHAFT
        sigma = self.scene.robot.radial_sigma_m
        return [Contact(header, name, True, Time.of(row * ROW_NS), Time(), True, radius, sigma, part)]
