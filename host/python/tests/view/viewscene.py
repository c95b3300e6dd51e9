"""A drawn scene as the robot's messages, with the estimates and the belief that a filter really has of it."""

from dataclasses import replace
from functools import partial

import numpy as np
from viewrobot import ROW_NS

from crunchbot import observation as o
from crunchbot.nav.filters import Filter
from crunchbot.observation import NORMAL, POINT
from crunchbot.pilot.pilot import compose
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.belief import condense, to_message
from crunchbot_lab.scenes import arenas
from crunchbot_lab.scenes.families import Recipe, recipe
from crunchbot_lab.scenes.making import make_recipe

FILTER = "adaptive"
ALIKE = replace(
    recipe("robot+global+normals"), arena=arenas.symmetric(2)
)  # the demo's robot where half a turn changes nothing


class SceneRun:
    """`messages(row)` gives what is sent for a row; ask for each row once, in order."""

    def __init__(self, recipe: Recipe, seed: int, rows: int):
        made = make_recipe(recipe, seed, rows)
        self.scene, self._rows = made.scene, made.observations
        self._filter = Filter(FILTER, self.scene, seed=seed, normals=True)
        self._pose = np.zeros(3)
        self._rays = [ray.name for ray in self.scene.robot.of_role("object")]
        tips = [tip.name for tip in self.scene.robot.of_role("texture")]
        self._names = [f"{tip}_{texture}" for tip in tips for texture in self.scene.arena.textures]
        self._names += [f"{ray}_mm" for ray in self._rays]
        self._names += [f"{ray}_{name}" for ray in self._rays for name in (*NORMAL, *POINT)]
        self._onset: dict[int, int] = {}

    def messages(self, row: int) -> list[tuple[str, object]]:
        """(topic, message) in the order they are sent."""
        estimate, _ = self._filter.replay(self._rows, row, 1)
        at = partial(m.Header.at, row * ROW_NS)
        pose = m.PoseWithCovariance.planar(estimate[0]["pose"], estimate[0]["covariance"])
        reported = [("observation", self._observation(row))]
        confidence = float(estimate[0]["confidence"])
        reported.append(("localisation", m.Localisation(at("map"), FILTER, pose, confidence, row, prior="uniform")))
        reported.append(("truth", m.PoseStamped(at("map"), m.Pose.planar(*self._rows.truth[row]))))
        reported += [("contact", contact) for ray in range(len(self._rays)) for contact in self._contact(row, ray)]
        if row % 5 == 0:
            components = self._filter.components()
            reported.append(("belief", to_message(at("map"), FILTER, row, len(components), condense(components))))
        if row % 10 == 0:
            counts = [m.KeyValue("rows", str(row)), m.KeyValue("states", str(estimate[0]["states"]))]
            reported.append(("health/pilot", m.ProcessHealth(at(), "pilot", 4005, "running", counts[:1])))
            reported.append(("health/navigator", m.ProcessHealth(at(), "navigator", 4009, "running", counts)))
        if row == 0:
            reported.append(("behaviour", m.Behaviour(at(), "EXPLORE", m.Time(), "replayed from a drawn scene")))
        return reported

    def _observation(self, row: int) -> m.Observation:
        texture, radial = self._rows.texture[row].ravel(), 1e3 * self._rows.radial_m[row]
        cells = np.where(np.isnan(texture), o.EMPTY, o.VALUE)
        cells = np.append(cells, np.select([np.isnan(radial), np.isinf(radial)], [o.NOT_READ, o.EMPTY], o.VALUE))
        touched = self._touched(row)
        cells = np.append(cells, np.where(np.isnan(touched), o.EMPTY, o.VALUE))
        values = np.where(cells == o.VALUE, np.concatenate([texture, radial, touched]), 0.0)
        motion = self._rows.odometry[row]
        self._pose = compose(self._pose, motion)
        return m.Observation(
            m.Header.at(row * ROW_NS), row, o.EXPLORING, motion, self._pose, self._names, cells.astype(np.uint8), values
        )

    def _touched(self, row: int) -> np.ndarray:
        """Cells of the directions, and the points at the whiskers' ends."""
        reported = np.full((len(self._rays), 5), np.nan)
        reported[:, :2] = self._rows.normal[row]
        for ray, whisker in enumerate(self.scene.robot.of_role("object")):
            if np.isfinite(reported[ray, 0]):
                out = self._rows.radial_m[row, ray] * np.array([np.cos(whisker.yaw_rad), np.sin(whisker.yaw_rad)])
                reported[ray, 2:] = *(whisker.base_m + out), 0.001
        return reported.ravel()

    def _contact(self, row: int, ray: int) -> list[m.Contact]:
        """A touch that begins, measured at once, or that is over."""
        radius, header = float(self._rows.radial_m[row, ray]), m.Header.at(row * ROW_NS)
        name, whisker = self._rays[ray], self.scene.robot.of_role("object")[ray]
        if not np.isfinite(radius):
            began = self._onset.pop(ray, None)
            over = began is not None
            return [m.Contact(header, name, False, m.Time.of(began * ROW_NS), m.Time.of(row * ROW_NS))] if over else []
        if ray in self._onset:
            return []
        self._onset[ray] = row
        part = m.TIP if radius > 0.6 * whisker.length_m else m.SHAFT
        sigma = self.scene.robot.radial_sigma_m
        return [m.Contact(header, name, True, m.Time.of(row * ROW_NS), m.Time(), True, radius, sigma, part)]
