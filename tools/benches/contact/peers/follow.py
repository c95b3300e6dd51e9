"""A contact of a chain of 20 links in MuJoCo, given sample by sample. Run by ../scenes.py.

    follow.py grip '{"beam": {...}, "object": "peg", "place": [x, y], "radius": 0, "normal": 0, "friction": 0.3,
    "bases": [[...]]}'

The mount is driven along the bases (velocity along and across the unbent whisker, rate of turn; one row a tick). The
object stands still: only the motion between the two matters. One line of JSON: tilt of the plug's hinge, place of the
contact on the axis, the direction of its normal in the mount's frame and the share of the friction cone that the force
uses, each tick; null where nothing touches.
"""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "mechanics/peers"))

import mujoco
import numpy as np
from chain import LINK_RADIUS, MOUNT_INERTIA, PEG_RADIUS, Beam, model_xml, whisker_xml

STEP_S, TICK_S = 5e-5, 5e-4
DAMPING_S = 1e-3  # damping over stiffness of every hinge: a damping ratio of 0.1 at 32 Hz
LEAD = 600  # ticks driven as in the first one before the scene begins: what the start excites has decayed


def thing(spec: dict) -> str:
    """The object, its surface a link's radius from the place that the axis touches."""
    x, y = spec["place"]
    contact = 'contype="2" conaffinity="1"'
    c, s = np.cos(spec["normal"]), np.sin(spec["normal"])
    if spec["object"] == "face":
        depth = 0.05
        x, y = x - (depth + LINK_RADIUS) * c, y - (depth + LINK_RADIUS) * s
        return (
            f'<geom name="thing" type="box" {contact} pos="{x} {y} 0" size="{depth} 0.5 0.02" '
            f'euler="0 0 {np.degrees(spec["normal"])}"/>'
        )
    radius = PEG_RADIUS if spec["object"] == "peg" else spec["radius"] - LINK_RADIUS
    x, y = x - (radius + LINK_RADIUS) * c, y - (radius + LINK_RADIUS) * s
    return f'<geom name="thing" type="cylinder" {contact} pos="{x} {y} 0" size="{radius} 0.02"/>'


class Contact:
    """A whisker on a mount that slides and turns, and an object that stands."""

    def __init__(self, spec: dict):
        heavy = f'armature="{MOUNT_INERTIA}"'
        mount = (
            f'<joint type="slide" axis="1 0 0" {heavy}/><joint type="slide" axis="0 1 0" {heavy}/>'
            f'<joint type="hinge" axis="0 0 1" {heavy}/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        )
        beam = Beam(spec["beam"])
        body = whisker_xml(beam, "w", 'pos="0 0 0"', DAMPING_S, ("0 0 1",), 'contype="1" conaffinity="2"', mount)
        self.model = mujoco.MjModel.from_xml_string(model_xml(body + thing(spec), spec["friction"], STEP_S))
        self.data = mujoco.MjData(self.model)

    def tick(self, pose: np.ndarray, base: np.ndarray) -> None:
        """Drives the mount for a tick from a pose (x, y, angle), and changes the pose."""
        for _ in range(round(TICK_S / STEP_S)):
            c, s = np.cos(pose[2]), np.sin(pose[2])
            rates = np.array([c * base[0] - s * base[1], s * base[0] + c * base[1], base[2]])
            self.data.qpos[:3], self.data.qvel[:3] = pose, rates
            mujoco.mj_step(self.model, self.data)
            pose += STEP_S * rates

    def reading(self, pose: np.ndarray) -> tuple[float, float, float, float] | None:
        """Place on the axis, direction of the normal, in the mount's frame, and friction used, by the contacts'
        forces."""
        wrench, total, place, normal, used = np.zeros(6), 0.0, np.zeros(2), np.zeros(2), 0.0
        for i in range(self.data.ncon):
            contact = self.data.contact[i]
            mujoco.mj_contactForce(self.model, self.data, i, wrench)
            link = next(g for g in contact.geom if self.model.geom(g).name != "thing")
            out = contact.frame[:3] * (1.0 if self.model.geom(contact.geom[0]).name == "thing" else -1.0)
            middle, along = self.data.geom_xpos[link], self.data.geom_xmat[link].reshape(3, 3)[:, 2]
            touched = middle + along * ((contact.pos - middle) @ along)
            place += wrench[0] * touched[:2]
            normal += wrench[0] * out[:2]
            used += float(np.hypot(wrench[1], wrench[2])) / contact.friction[0]
            total += wrench[0]
        if total <= 0.0:
            return None
        x, y = place / total - pose[:2]
        c, s = np.cos(pose[2]), np.sin(pose[2])
        return c * x + s * y, c * y - s * x, float(np.arctan2(normal[1], normal[0]) - pose[2]), used / total


def follow(spec: dict) -> dict:
    """Every tick of a scene; the mount's frame at its start is the world's."""
    scene = Contact(spec)
    bases = np.array(spec["bases"])
    lead = np.tile(bases[0], (LEAD, 1))
    pose = np.zeros(3)
    for base in lead:  # where the mount has to start from to be at the origin when the scene begins
        c, s = np.cos(pose[2]), np.sin(pose[2])
        pose += TICK_S * np.array([c * base[0] - s * base[1], s * base[0] + c * base[1], base[2]])
    c, s = np.cos(-pose[2]), np.sin(-pose[2])
    pose = np.array([-(c * pose[0] - s * pose[1]), -(s * pose[0] + c * pose[1]), -pose[2]])
    tilts, places = [], []
    for i, base in enumerate(np.concatenate([lead, bases])):
        scene.tick(pose, base)
        if i >= LEAD:
            tilts.append(float(scene.data.qpos[3]))
            places.append(scene.reading(pose))
    return {"tilt": tilts, "places": places, "mujoco": mujoco.__version__}


if __name__ == "__main__":
    print(json.dumps(follow(json.loads(sys.argv[2]))))
