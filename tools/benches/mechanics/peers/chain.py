"""A whisker as a chain of rigid links in MuJoCo: statics at a peg, natural frequencies, speed. Run by ../bench.py.

The whisker is cut into equal segments; the bending of each is a hinge with a spring, at the place and of the stiffness
that make the segment's end turn and move as the beam's would. The plug is one more hinge at the exit. Nothing here
knows the simulator that it is compared with: the base moment is that of MuJoCo's contact force about the exit.

    chain.py static '{"links": 20, ...}'     moments, contact positions, slip-off: one line of JSON
    chain.py modes '{...}'                    frequencies
    chain.py edge '{"height": 3e-4, ...}'     a tip dragged over an edge of the floor: time at the edge, moments
    chain.py speed '{"links": 5}'             28 whiskers, 8 on a moving floor, 4 on moving pegs
"""

import json
import sys
import time

import mujoco
import numpy as np

LINK_RADIUS = 2e-4  # of the contact shape only; readings are taken on the axis
PEG_RADIUS = 5e-4
STEP_S = 500e-6
STATIC_STEP_S = 50e-6  # MuJoCo's contacts do not know of damping: at long steps a peg passes through a damped beam
MOUNT_INERTIA = 1e3  # kg m^2: what the whisker does to its mount is nothing
STATIC_DAMPING_S = 4e-4  # damping over stiffness of every hinge
SETTLE_S, AVERAGE_S, READINGS = 0.2, 0.15, 60
FAST_DEG_S, SLOW_DEG_S = 25.0, 10.0  # the peg's speed
FLOOR_SPEED = 0.1
EDGE_STEP_S = 20e-6
EDGE_DAMPING_S = 1e-5  # damping over stiffness of every hinge, beside the damping of the modes
DAMPED_HZ = 1000.0  # modes up to here have the damping ratio that is asked for
LOWER_S, LEAD_IN = 0.15, 20e-3  # the mount goes down to its height; then it travels this far before the edge
COLLIDING = 0.15  # share of the length, from the tip, that can touch the floor


class Beam:
    """A tapered beam cut into links. Lengths in m."""

    def __init__(self, spec: dict):
        self.length, self.exit, self.cone = spec["length"], spec["exit_diameter"], spec["cone"]
        self.young, self.density = spec["young"], spec["density"]
        self.plug = spec["plug"]  # N m/rad; None: clamped
        self.links = spec["links"]

    def hinges(self) -> tuple[np.ndarray, np.ndarray]:
        """Position and stiffness of the hinge of each segment."""
        edges = np.linspace(0, self.length, self.links + 1) / self.cone
        bending = self.young * np.pi * self.exit**4 / 64
        turn = (1 - edges) ** -3 / 3  # integral of ds/EI, in cone/(E I0)
        first = (1 - edges) ** -3 / 3 - (1 - edges) ** -2 / 2  # integral of s ds/EI
        compliance = np.diff(turn)
        return np.diff(first) / compliance * self.cone, bending / self.cone / compliance

    def mass(self, start: float, end: float) -> tuple[float, float, float]:
        """Mass, centre and moment of inertia across the axis, of a piece."""
        nodes, weights = np.polynomial.legendre.leggauss(8)
        s = (start + end) / 2 + (end - start) / 2 * nodes
        d = self.exit * (1 - s / self.cone)
        line = self.density * np.pi / 4 * d**2 * weights * (end - start) / 2
        mass = line.sum()
        centre = (line * s).sum() / mass
        return mass, centre, (line * ((s - centre) ** 2 + d**2 / 16)).sum()


def whisker_xml(
    beam: Beam, name: str, place: str, damping_s: float, axes: tuple[str, ...], contact: str, mount: str = ""
) -> str:
    """The whisker along +x of its own frame. Bending of each axis is one hinge."""
    at, stiffness = beam.hinges()
    if beam.plug is not None:
        at, stiffness = np.concatenate([[0], at]), np.concatenate([[beam.plug], stiffness])
    ends = np.append(at[1:], beam.length)
    text, close = f'<body name="{name}" {place}>{mount}', "</body>"
    if at[0] > 0:
        text += f'<geom type="capsule" fromto="0 0 0 {at[0]} 0 0" size="{LINK_RADIUS}" mass="0" {contact}/>'
    before = 0.0
    for i, (start, end, k) in enumerate(zip(at, ends, stiffness, strict=True)):
        mass, centre, inertia = beam.mass(start, end)
        text += f'<body pos="{start - before} 0 0">'
        for axis in axes:
            text += f'<joint type="hinge" axis="{axis}" stiffness="{k}" damping="{k * damping_s}"/>'
        text += (
            f'<inertial pos="{centre - start} 0 0" mass="{mass}" diaginertia="{max(inertia / 50, 2e-15)} {inertia} '
            f'{inertia}"/>'
            f'<geom name="{name}_{i}" type="capsule" fromto="0 0 0 {end - start} 0 0" size="{LINK_RADIUS}" mass="0" '
            f"{contact}/>"
        )
        before, close = start, close + "</body>"
    return text + close


def model_xml(body: str, friction: float, step: float) -> str:
    return (
        f'<mujoco><option timestep="{step}" integrator="implicitfast" cone="elliptic" gravity="0 0 0" '
        'impratio="10"/><default><geom solref="0.002 1" solimp="0.99 0.999 0.0001" '
        f'condim="{3 if friction else 1}" friction="{friction} 0 0" margin="0"/></default>'
        f'<compiler boundmass="1e-12" boundinertia="1e-18"/><worldbody>{body}</worldbody></mujoco>'
    )


class Peg:
    """A whisker whose mount turns against a peg that stands still: MuJoCo's friction knows velocities of joints
    only."""

    def __init__(self, beam: Beam, friction: float, a: float):
        mount = 'pos="0 0 0"'
        driven = f'<joint type="hinge" axis="0 0 1" armature="{MOUNT_INERTIA}"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        body = whisker_xml(beam, "w", mount, STATIC_DAMPING_S, ("0 0 1",), 'contype="1" conaffinity="2"', driven)
        body += (
            '<body name="peg"><geom name="peg" type="capsule" contype="2" conaffinity="1" '
            f'fromto="{a} {-PEG_RADIUS - LINK_RADIUS} -0.005 {a} {-PEG_RADIUS - LINK_RADIUS} 0.005" '
            f'size="{PEG_RADIUS}"/></body>'
        )
        self.model = mujoco.MjModel.from_xml_string(model_xml(body, friction, STATIC_STEP_S))
        self.data = mujoco.MjData(self.model)
        self.theta = 0.0

    def lead(self, theta: float) -> None:
        """Turns the mount so that the peg stands at this angle about the unbent whisker."""
        self.data.qvel[0] = -(theta - self.theta) / STATIC_STEP_S
        self.data.qpos[0] = -self.theta
        self.theta = theta

    def run(self, start: float, end: float, speed: float, settle_s: float) -> float | None:
        """Moves at a speed (rad/s) and settles. Angle at which contact was lost for good, or None."""
        lost, moving = None, round((end - start) / speed / STATIC_STEP_S)
        for i in range(moving + round(settle_s / STATIC_STEP_S)):
            theta = start + (end - start) * min(1.0, (i + 1) / max(moving, 1))
            self.lead(theta)
            mujoco.mj_step(self.model, self.data)
            if self.data.ncon:
                lost = None
            elif lost is None:
                lost = theta
        return lost

    def reading(self) -> dict | None:
        """Where the axis is touched, and the base moment of the force there."""
        moment = arc = theta = radius = force_sum = 0.0
        exit_body = self.model.body("w").id
        wrench = np.zeros(6)
        for i in range(self.data.ncon):
            contact = self.data.contact[i]
            mujoco.mj_contactForce(self.model, self.data, i, wrench)
            force = contact.frame.reshape(3, 3).T @ wrench[:3]
            link = next(g for g in contact.geom if self.model.geom(g).name != "peg")
            if self.model.geom(contact.geom[0]).name != "peg":
                force = -force  # MuJoCo's force acts on the second shape
            middle, turn = self.data.geom_xpos[link], self.data.geom_xmat[link].reshape(3, 3)
            along = turn[:, 2]
            touched = middle + along * ((contact.pos - middle) @ along)
            moment += touched[0] * force[1] - touched[1] * force[0]
            body = self.model.geom_bodyid[link]
            inside = (touched - self.data.xpos[body]) @ self.data.xmat[body].reshape(3, 3)[:, 0]
            start = sum(self.model.body_pos[b][0] for b in range(exit_body + 1, body + 1))
            size = abs(wrench[0])
            arc += size * (start + inside)
            theta += size * (np.arctan2(touched[1], touched[0]) + self.theta)
            radius += size * np.hypot(touched[0], touched[1])
            force_sum += size
        if force_sum <= 0:
            return None
        return {
            "theta": theta / force_sum,
            "a": radius / force_sum,
            "arc": arc / force_sum,
            "moment": abs(moment),
            "force": force_sum,
        }


def average(readings: list[dict]) -> dict:
    return {key: float(np.mean([reading[key] for reading in readings])) for key in readings[0]}


def static(spec: dict) -> dict:
    """Readings at growing angles until the whisker slips off; angles at which it bounces are left out.

    Without friction each is settled and then averaged over AVERAGE_S: what still swings cancels. MuJoCo's friction
    creeps, so with friction the peg goes on slowly and readings over the last half degree are averaged: the contact
    slides towards the tip.
    """
    peg = Peg(Beam(spec), spec["friction"], spec["a"])
    rows, last, rough = [], 0.0, spec["friction"] > 0
    for theta in np.radians(spec["angles_deg"]):
        near = theta - np.radians(0.5) if rough else theta
        lost = peg.run(last, near, np.radians(SLOW_DEG_S if rough else FAST_DEG_S), 0 if rough else SETTLE_S)
        found = []
        for i in range(READINGS if lost is None else 0):
            if rough:
                step = (theta - near) / READINGS
                lost = peg.run(near + i * step, near + (i + 1) * step, np.radians(SLOW_DEG_S), 0)
            else:
                lost = peg.run(theta, theta, 1.0, AVERAGE_S / READINGS)
            found.append(peg.reading())
        if lost is not None:
            return {"rows": rows, "slipped_deg": float(np.degrees(lost))}
        if None not in found:
            rows.append(average(found))
        last = theta
    return {"rows": rows, "slipped_deg": None}


def modes(spec: dict) -> dict:
    """The lowest frequencies, Hz, free or with one point of the axis held."""
    beam = Beam(spec)
    xml = model_xml(whisker_xml(beam, "w", 'pos="0 0 0"', 0, ("0 0 1",), 'contype="0" conaffinity="0"'), 0, STEP_S)
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    stiffness = np.diag(model.jnt_stiffness[:, 0] if model.jnt_stiffness.ndim > 1 else model.jnt_stiffness)
    if spec["pinned_at"]:
        hinge = np.cumsum(model.body_pos[2:, 0])
        row = np.maximum(0, spec["pinned_at"] - hinge)[None, :]
        kept = np.linalg.svd(row)[2][1:].T
        mass, stiffness = kept.T @ mass @ kept, kept.T @ stiffness @ kept
    root = np.linalg.inv(np.linalg.cholesky(mass))
    square = np.linalg.eigvalsh(root @ stiffness @ root.T)
    return {"hz": (np.sqrt(np.sort(square)[:4]) / (2 * np.pi)).tolist()}


def edge_xml(beam: Beam, stance: dict, height: float, friction: float) -> str:
    """A whisker whose mount travels along +x, over a floor that is `height` higher beyond x = 0."""
    behind, above = stance["behind"], stance["height"]
    aside = np.sqrt(beam.length**2 - behind**2 - above**2)
    along = np.array([-behind, aside, -above]) / beam.length
    level = np.array([aside, behind, 0]) / np.hypot(aside, behind)
    contact = 'contype="0" conaffinity="0"'
    axes = " ".join(f"{v}" for v in (*along, *level))
    start = behind - LEAD_IN
    driven = "".join(
        f'<joint name="{name}" type="slide" axis="{axis}" armature="{MOUNT_INERTIA}"/>'
        for name, axis in (("travel", "1 0 0"), ("lower", "0 0 1"))
    )
    driven += '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    body = f'<body pos="{start} {-aside} {above + stance["tip_radius"]}">{driven}'
    body += (
        whisker_xml(beam, "w", f'pos="0 0 0" xyaxes="{axes}"', EDGE_DAMPING_S, ("0 0 1", "0 1 0"), contact) + "</body>"
    )
    low, high = min(height, 0), max(height, 0)
    side = 1 if height > 0 else -1
    plate = 'type="box" contype="2" conaffinity="1"'
    body += f'<geom name="floor" {plate} pos="0 0 {low - 0.05}" size="1 1 0.05"/>'
    body += f'<geom name="step" {plate} pos="{side * 0.5} 0 {high - 0.05}" size="0.5 1 0.05"/>'
    return model_xml(body, friction, EDGE_STEP_S)


def edge_model(beam: Beam, spec: dict) -> mujoco.MjModel:
    """Only the links next to the tip collide, with the tip's radius; contacts are as hard as the step allows."""
    model_spec = mujoco.MjSpec.from_string(edge_xml(beam, spec["stance"], spec["height"], spec["friction"]))
    for i in range(round(beam.links * (1 - COLLIDING)) + 1, beam.links + 1):
        shape = model_spec.geom(f"w_{i}")
        shape.contype, shape.conaffinity, shape.size[0] = 1, 2, spec["stance"]["tip_radius"]
    for shape in model_spec.geoms:
        shape.solref[0] = spec["contact_s"]
    return model_spec.compile()


def modal_damping(model: mujoco.MjModel, data: mujoco.MjData, ratio: float) -> np.ndarray:
    """Torque per velocity of the whisker's hinges, about the straight whisker, beside the hinges' own damping."""
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    mass = mass[2:, 2:]
    stiffness = (model.jnt_stiffness[:, 0] if model.jnt_stiffness.ndim > 1 else model.jnt_stiffness)[2:]
    root = np.linalg.cholesky(mass)
    inverse = np.linalg.inv(root)
    square, shapes = np.linalg.eigh(inverse * stiffness @ inverse.T)
    omega = np.sqrt(square)
    missing = np.where(omega < 2 * np.pi * DAMPED_HZ, 2 * ratio * omega - EDGE_DAMPING_S * square, 0)
    return (root @ shapes * missing) @ (root @ shapes).T


def edge(spec: dict) -> dict:
    """Seconds from the first touch of the edge to the last, and the base moments about that time (N m)."""
    beam = Beam(spec)
    model = edge_model(beam, spec)
    data = mujoco.MjData(model)
    plug = beam.plug * np.ones(2)
    damping = modal_damping(model, data, spec["damping"])
    radius = spec["stance"]["tip_radius"]
    touched, rows = [], []
    time_s, ramp = LOWER_S + (LEAD_IN + spec["after"]) / spec["speed"], 0.02
    tip = model.geom(f"w_{beam.links}").id
    half = model.geom_size[tip][1]
    for i in range(round(time_s / EDGE_STEP_S)):
        now = i * EDGE_STEP_S
        data.qvel[0] = spec["speed"] * min(1, max(0, (now - LOWER_S) / ramp))
        data.qvel[1] = -spec["stance"]["preload"] / (LOWER_S - 0.05) if now < LOWER_S - 0.05 else 0
        data.qfrc_applied[2:] = -damping @ data.qvel[2:]
        mujoco.mj_step(model, data)
        at = data.geom_xpos[tip] - half * data.geom_xmat[tip].reshape(3, 3)[:, 2]
        rows.append((now, data.qpos[0], at[0], at[2] - radius, *(plug * data.qpos[2:4])))
        # The edge pushes against the travel; a flat floor only upwards.
        touched.append(any(abs(contact.frame[0]) > 0.05 for contact in data.contact[: data.ncon]))
    rows = np.array(rows)
    return edge_answer(spec, rows, np.array(touched))


def edge_answer(spec: dict, rows: np.ndarray, touched: np.ndarray) -> dict:
    when, travelled = rows[:, 0], rows[:, 1]
    at_edge = np.flatnonzero(touched)
    held = (at_edge[-1] - at_edge[0] + 1) * EDGE_STEP_S if len(at_edge) else 0.0
    before = (travelled > 0.5 * LEAD_IN) & (travelled < 0.75 * LEAD_IN)
    after = travelled > 0.75 * LEAD_IN
    every = rows[:: max(1, round(5e-4 / EDGE_STEP_S))]
    return {
        "held_s": held,
        "rest": rows[when < LOWER_S][-1, 4:].tolist(),
        "steady": rows[before, 4:].mean(axis=0).tolist(),
        "peak": float(np.abs(rows[after, 4]).max()),
        "trace": {name: every[:, i].tolist() for i, name in enumerate(("time", "travel", "x", "z", "along", "across"))}
        if spec.get("trace")
        else None,
    }


def scene_xml(beam: Beam) -> str:
    """28 whiskers with two hinges a link: 4 on pegs, 8 with their tips pressed on a floor, 16 free."""
    axes, body = ("0 0 1", "0 1 0"), ""
    for i in range(28):
        bit = 1 << (i + 1) if i < 4 else 1
        contact = f'contype="{bit}" conaffinity="{bit}"' if i < 12 else 'contype="0" conaffinity="0"'
        down = "" if not 4 <= i < 12 else 'euler="0 30 0"'
        body += whisker_xml(beam, f"w{i}", f'pos="0 {0.3 * i} 0" {down}', 0.001, axes, contact)
        if i < 4:
            body += (
                f'<body name="peg{i}" mocap="true"><geom type="capsule" {contact} '
                f'fromto="0 0 -0.02 0 0 0.02" size="0.001"/></body>'
            )
    floor = -beam.length * np.sin(np.radians(30)) + 0.005
    body += (
        f'<body name="floor" mocap="true" pos="0 2.3 {floor - 0.05}"><geom type="box" size="5 2 0.05" '
        'contype="1" conaffinity="1"/></body>'
    )
    return model_xml(body, 0.3, STEP_S)


def speed(spec: dict) -> dict:
    """Simulated seconds per second of one core."""
    model = mujoco.MjModel.from_xml_string(scene_xml(Beam(spec)))
    data = mujoco.MjData(model)
    floor = data.mocap_pos[4].copy()

    def run(seconds: float) -> float:
        started, touching = time.process_time(), 0
        for _ in range(round(seconds / STEP_S)):
            for i in range(4):
                theta = 0.09 + 0.05 * np.sin(2 * np.pi * 0.5 * data.time)
                data.mocap_pos[i] = (0.11 * np.cos(theta), 0.3 * i + 0.11 * np.sin(theta) - 0.001, 0)
            data.mocap_pos[4] = floor + np.array([FLOOR_SPEED * data.time % 1.0, 0, 0])
            mujoco.mj_step(model, data)
            touching += data.ncon
        self_time = time.process_time() - started
        run.contacts = touching / round(seconds / STEP_S)
        return seconds / self_time

    run(0.1)
    rate = run(spec["seconds"])
    return {"times_real": rate, "contacts": run.contacts, "unstable": bool(not np.isfinite(data.qpos).all())}


if __name__ == "__main__":
    job = {"static": static, "modes": modes, "speed": speed, "edge": edge}[sys.argv[1]]
    print(json.dumps(job(json.loads(sys.argv[2])) | {"mujoco": mujoco.__version__}))
