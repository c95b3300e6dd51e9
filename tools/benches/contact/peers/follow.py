"""A contact of a chain of 20 links in MuJoCo, given sample by sample. Run by ../scenes.py.

    follow.py grip '{"beam": {...}, "thing": {"kind": "peg"}, "place": [x, y], "normal": 0, "friction": 0.3,
    "bases": [[...]]}'

The mount is driven along the bases (velocity along and across the unbent whisker, rate of turn; one row a tick). The
object stands still: only the motion between the two matters. Objects: a peg; a face with how far it goes on from the
touch towards the mount and away from it; an ellipse of two semi-axes; a wedge of an angle, the direction of its edge
being `lean`. One line of JSON: tilt of the plug's hinge, place of the contact on the axis, the direction of its normal
in the mount's frame and the share of the friction cone that the force uses, each tick; null where nothing touches.
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


CONTACT = 'name="thing" contype="2" conaffinity="1"'
DEPTH = 0.05  # of a face's and a wedge's body
HEIGHT = 0.02  # across the plane, half


def face_xml(spec: dict, x: float, y: float) -> str:
    """`x`, `y`: where the surface is touched."""
    inward, outward = spec["thing"]["ends"]
    c, s = np.cos(spec["normal"]), np.sin(spec["normal"])
    along = 0.5 * (outward - inward)  # of the middle from the touch, in the direction (s, -c), away from the mount
    x, y = x - DEPTH * c + along * s, y - DEPTH * s - along * c
    return (
        f'<geom {CONTACT} type="box" pos="{x} {y} 0" size="{DEPTH} {0.5 * (inward + outward)} {HEIGHT}" '
        f'euler="0 0 {np.degrees(spec["normal"])}"/>'
    )


def ellipse_xml(spec: dict, x: float, y: float) -> str:
    """`lean`: direction of the first axis."""
    thing = spec["thing"]
    axes, turn = np.array(thing["axes"]) - LINK_RADIUS, spec["normal"] - thing["lean"]
    out = np.array([np.cos(turn), np.sin(turn)])
    from_middle = axes**2 * out / np.hypot(*(axes * out))
    c, s = np.cos(thing["lean"]), np.sin(thing["lean"])
    x, y = x - c * from_middle[0] + s * from_middle[1], y - s * from_middle[0] - c * from_middle[1]
    size = f'type="ellipsoid" size="{axes[0]} {axes[1]} 0.5" euler="0 0 {np.degrees(thing["lean"])}"'
    return f'<geom {CONTACT} {size} pos="{x} {y} 0"/>'


def wedge_xml(spec: dict, x: float, y: float) -> tuple[str, str]:
    """A prism whose edge points along `lean`."""
    thing, corners = spec["thing"], [(0.0, 0.0)]
    for side in (-0.5, 0.5):
        turn = thing["lean"] + np.pi + side * thing["angle"]
        corners.append((DEPTH * np.cos(turn), DEPTH * np.sin(turn)))
    vertices = " ".join(f"{x + a} {y + b} {z}" for a, b in corners for z in (-HEIGHT, HEIGHT))
    return f'<asset><mesh name="wedge" vertex="{vertices}"/></asset>', f'<geom {CONTACT} type="mesh" mesh="wedge"/>'


def peg_xml(spec: dict, x: float, y: float) -> str:
    c, s = np.cos(spec["normal"]), np.sin(spec["normal"])
    return f'<geom {CONTACT} type="cylinder" pos="{x - PEG_RADIUS * c} {y - PEG_RADIUS * s} 0" size="{PEG_RADIUS} {HEIGHT}"/>'


THINGS = {"peg": peg_xml, "face": face_xml, "ellipse": ellipse_xml, "wedge": wedge_xml}


def thing(spec: dict) -> tuple[str, str]:
    """Assets and shape of the object, its surface a link's radius from the place that the axis touches."""
    (x, y), c, s = spec["place"], np.cos(spec["normal"]), np.sin(spec["normal"])
    made = THINGS[spec["thing"]["kind"]](spec, x - LINK_RADIUS * c, y - LINK_RADIUS * s)
    return made if isinstance(made, tuple) else ("", made)


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
        assets, shape = thing(spec)
        text = model_xml(body + shape, spec["friction"], STEP_S).replace("<worldbody>", f"{assets}<worldbody>")
        self.model = mujoco.MjModel.from_xml_string(text)
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
