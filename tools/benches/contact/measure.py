"""What the contact filter says in scenes of each kind, beside the truth and the Cramer-Rao bound."""

import time
from collections.abc import Iterator

import numpy as np

from whisker.touch.contact_filter import ContactFilter

from .scenes import FRICTION_SD, QUARTER, REACH_M, TICK_S, TIP, Corner, Draw, Plan, Scene, chained, simulated

FIRST_S = 0.1  # figures count from here on: the contact has moved by a centimetre at 0.1 m/s
NINETY_2, NINETY_1 = 4.605, 2.706  # chi-squared, 90 %, of two and of one degree of freedom
SPEED, WHISK = 0.1, np.pi / 24
TURN_BACK_S = 0.15
FLAT_M, CYLINDER_M = 5.0, 0.05  # radii


def straight(ticks: int, speed: float, angle: float) -> np.ndarray:
    """(ticks, 3): driven at an angle about the direction across the whisker that bends it towards +y."""
    return np.tile([speed * np.sin(angle), -speed * np.cos(angle), 0.0], (ticks, 1))


def standing(ticks: int) -> np.ndarray:
    return np.zeros((ticks, 2))


def corner_drive(rng) -> Plan:
    bases = straight(700, SPEED, rng.uniform(-0.4, 0.4))
    return Plan(bases, standing(700), rng.uniform(0.07, 0.125))


def corner_whisk(rng) -> Plan:
    return Plan(np.tile([0.0, 0.0, -WHISK], (1400, 1)), standing(1400), rng.uniform(0.07, 0.130))


def face(rng) -> Plan:
    normal = rng.uniform(np.radians(97), np.radians(135))
    bases = straight(900, rng.uniform(0.05, SPEED), rng.uniform(-0.3, 0.3) + normal - QUARTER)
    return Plan(bases, standing(900), TIP, FLAT_M, normal)


def cylinder(rng) -> Plan:
    bases = straight(900, SPEED, 0.0)
    if rng.uniform() < 0.5:
        return Plan(bases, standing(900), rng.uniform(0.08, 0.13), CYLINDER_M)
    return Plan(bases, standing(900), TIP, CYLINDER_M, rng.uniform(np.radians(97), np.radians(118)))


def moving(rng, still: bool = False) -> Plan:
    """An object that moves; the base stands, then retreats from it or, `still`, goes on standing."""
    ticks, speed, angle = 700, rng.uniform(0.03, 0.1), rng.uniform(-0.4, 0.4)
    velocity = np.tile([-speed * np.sin(angle), speed * np.cos(angle)], (ticks, 1))
    bases = np.zeros((ticks, 3))
    if not still:
        bases[round(TURN_BACK_S / TICK_S) :, 1] = 0.6 * speed
    return Plan(bases, velocity, rng.uniform(0.07, 0.12))


KINDS = {
    "corner, drive": corner_drive,
    "corner, body whisk": corner_whisk,
    "face, drive": face,
    "cylinder, drive": cylinder,
    "moving corner, base moves": moving,
    "moving corner, base stands": lambda rng: moving(rng, still=True),
}
TRUE_MOTION = dict(zip(KINDS, ("drive-by", "body whisk", "drive-by", "drive-by", "sweep", "sweep"), strict=True))


def contacts(kind: str, count: int, known_friction: bool, links: bool) -> Iterator[tuple[Scene, np.ndarray | None]]:
    """Scenes of a kind, by the simulator or by a chain of links, and of corners the bound (n,) of the error, mm."""
    for seed in range(count):
        draw = Draw.of(1000 * list(KINDS).index(kind) + seed, known_friction)
        plan = KINDS[kind](draw.rng)
        least = None
        if plan.round_m == 0.0 and not links:
            least = Corner(plan).bound(draw, settings(known_friction)["friction_sd"])
        made = (chained if links else simulated)(plan, draw)
        if made is not None and len(made.tilt) > 1.2 * FIRST_S / TICK_S:
            yield made, least


def settings(known_friction: bool) -> dict[str, float]:
    return {"friction_sd": 0.0 if known_friction else FRICTION_SD}


def follow(scene: Scene, least: np.ndarray | None, known_friction: bool, links: bool) -> dict[str, np.ndarray | float]:
    """Errors of one contact's reports; angles degrees, lengths mm."""
    held = ContactFilter(**settings(known_friction), **({"creep": 0.0} if links else {}))
    start = first_touch(scene)
    bases, tilt = scene.bases[start:], scene.tilt[start:]
    told = held.run(bases, tilt)
    at = told.sample + start
    use = np.hypot(*scene.point[at].T) < TIP + REACH_M
    at = at[use]
    off = told.point[use] - scene.point[at]
    turn = np.degrees(told.normal_rad[use] - scene.normal[at])
    speed = np.hypot(*scene.velocity[at].T)
    return {
        "after_s": told.sample[use] * TICK_S,
        "off": 1e3 * np.hypot(*off.T),
        "stated": 1e3 * np.sqrt(np.trace(told.point_cov[use], axis1=1, axis2=2)),
        "least": least[at] if least is not None else np.full(len(at), np.nan),
        "inside": np.einsum("ki,kij,kj->k", off, np.linalg.inv(told.point_cov[use]), off) < NINETY_2,
        "turn": turn,
        "turn_inside": (turn / np.degrees(told.normal_sd[use])) ** 2 < NINETY_1,
        "contour": 1e3 * np.abs(np.hypot(*(told.point[use] - scene.centre[at]).T) - CYLINDER_M),
        "speed": (told.speed[use] - speed) / np.where(speed > 1e-9, speed, np.nan),
        "speed_inside": (told.speed[use] - speed) ** 2 < NINETY_1 * told.speed_sd[use] ** 2,
        "motion": np.array(told.motion)[use],
        "corner": told.corner[use],
        "cost_us": cost_us(held, bases, tilt),
    }


def cost_us(held: ContactFilter, bases: np.ndarray, tilt: np.ndarray) -> float:
    """CPU time of a sample in C, from a new contact on."""
    from whisker.native import doubles, ffi, lib, octets

    held.begin()
    count = len(tilt)
    good, made, middles = np.ones(count, np.uint8), ffi.new("struct nav_contact_answer[]", count), np.empty(count)
    columns = doubles(bases, "bases", (count, 3)), doubles(tilt, "tilt", (count, 2)), octets(good, "good", (count,))
    began = time.process_time()
    lib.nav_contact_filter_run(held.state, *columns, count, made, doubles(middles, "middles", (count,)), count)
    return 1e6 * (time.process_time() - began) / count


def first_touch(scene: Scene) -> int:
    return int(np.argmax(scene.point[:, 1] > 0))
