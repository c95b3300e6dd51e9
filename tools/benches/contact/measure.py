"""What the contact filter says in scenes of each kind, beside the truth and the Cramer-Rao bound."""

import time
from typing import NamedTuple

import numpy as np

from crunchbot.pilot.feel import MODEL_RAD
from crunchbot.touch.contact_filter import ContactFilter

from .scenes import QUARTER, REACH_M, TICK_S, TIP, Corner, Draw, Plan, Scene, chained, lying

FIRST_S = 0.1  # figures count from here on: the contact has moved by a centimetre at 0.1 m/s
NINETY_2, NINETY_1 = 4.605, 2.706  # chi-squared, 90 %, of two and of one degree of freedom
SPEED, WHISK = 0.1, np.pi / 24
TURN_BACK_S = 0.15
WIDE_M, CYLINDER_M = 0.5, (0.045, 0.055)  # from the touch to a face's ends; radii
SHORT_M = (0.006, 0.020)  # from the touch to the nearer end of a short face
LONG_AXIS_M, SHORT_AXIS_M = (0.025, 0.070), (0.008, 0.030)  # halves of an ellipse's
NORMALS = np.radians([97, 135])  # of faces that the tip meets
ANY = np.radians(80)  # between drive and face's normal, at most
BLOCK = 20  # samples of the filter's
EDGE = 0.9  # share of the friction cone from which a contact slides
LIES_TICKS = 100  # that a whisker lies along a face before figures count


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


def face(rng, normal: float, angle: float, ends: tuple[float, float] = (WIDE_M, WIDE_M)) -> Plan:
    """Driven at an angle about the way against its normal."""
    bases = straight(900, rng.uniform(0.05, SPEED), normal - QUARTER + angle)
    return Plan(bases, standing(900), TIP, normal, {"kind": "face", "ends": list(ends)})


def face_along(rng) -> Plan:
    return face(rng, rng.uniform(*NORMALS), rng.uniform(-0.3, 0.3))


def face_across(rng) -> Plan:
    """Driven across the whisker: how the face lies hardly changes what is felt."""
    normal = rng.uniform(*NORMALS)
    return face(rng, normal, QUARTER - normal)


def face_any(rng) -> Plan:
    return face(rng, rng.uniform(*NORMALS), rng.uniform(-ANY, ANY))


def face_short(rng) -> Plan:
    """It ends near the touch, towards the mount or away from it."""
    ends = (rng.uniform(*SHORT_M), WIDE_M)
    return face(rng, rng.uniform(*NORMALS), rng.uniform(-ANY, ANY), ends if rng.uniform() < 0.5 else ends[::-1])


def rounded(rng, axes: list[float], lean: float) -> Plan:
    """An ellipse under the shaft or the tip."""
    thing = {"kind": "ellipse", "axes": axes, "lean": lean}
    bases = straight(900, rng.uniform(0.05, SPEED), rng.uniform(-0.4, 0.4))
    if rng.uniform() < 0.5:
        return Plan(bases, standing(900), rng.uniform(0.08, 0.13), QUARTER, thing)
    return Plan(bases, standing(900), TIP, rng.uniform(np.radians(97), np.radians(118)), thing)


def cylinder(rng) -> Plan:
    return rounded(rng, [rng.uniform(*CYLINDER_M)] * 2, 0.0)


def ellipse(rng) -> Plan:
    return rounded(rng, [rng.uniform(*LONG_AXIS_M), rng.uniform(*SHORT_AXIS_M)], rng.uniform(0.0, np.pi))


def wedge(rng) -> Plan:
    """Its edge points at the shaft."""
    angle = rng.uniform(np.radians(50), np.radians(90))
    lean = QUARTER + rng.uniform(-0.4, 0.4) * (QUARTER - angle / 2)
    bases = straight(700, rng.uniform(0.05, SPEED), rng.uniform(-0.4, 0.4))
    thing = {"kind": "wedge", "angle": angle, "lean": lean}
    return Plan(bases, standing(700), rng.uniform(0.07, 0.125), QUARTER, thing)


def there_and_back(rng) -> Plan:
    """The tip pushed into a face and drawn back along the same way: it slides, sticks and slides back."""
    plan, times = face(rng, rng.uniform(np.radians(105), NORMALS[1]), rng.uniform(-0.3, 0.3)), np.arange(900) * TICK_S
    return plan._replace(bases=plan.bases * np.interp(times, [0.2, 0.3], [1.0, -1.0])[:, None])


def head_on(rng) -> Plan:
    return face(rng, rng.uniform(np.radians(145), np.radians(178)), 0.0)


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
    "moving corner, base moves": moving,
    "moving corner, base stands": lambda rng: moving(rng, still=True),
    "cylinder": cylinder,
    "ellipse": ellipse,
    "wedge, its edge on the shaft": wedge,
    "face, along its normal": face_along,
    "face, across the whisker": face_across,
    "face, any angle": face_any,
    "short face, any angle": face_short,
    "face, there and back": there_and_back,
    "face, then lying along it": lambda rng: face_along(rng)._replace(lies=True),
    "face, head-on": head_on,
}


class Case(NamedTuple):
    """What the filter is given, and what bends the whisker."""

    kinds: tuple[str, ...]
    settings: dict[str, float]
    links: bool = False


CASES = {
    "simulated": Case(tuple(kind for kind in KINDS if "corner" in kind), {}),
    "chain": Case(tuple(kind for kind in KINDS if "moving" not in kind), {"creep": 0.0}, links=True),
}


def true_motion(kind: str) -> str:
    return "sweep" if kind.startswith("moving") else "body whisk" if kind.endswith("whisk") else "drive-by"


def drawn(kind: str, word: str, number: int) -> tuple[Plan, Draw]:
    draw = Draw.of(f"{word} {kind} {number}")
    return KINDS[kind](draw.rng), draw


def contact(case: Case, kind: str, word: str, number: int) -> dict | None:
    """What the filter says of a draw; None: nothing was felt for long enough."""
    plan, draw = drawn(kind, word, number)
    scene = chained(plan, draw) if case.links else Corner(plan).scene(draw)
    if scene is None or len(scene.tilt) <= 1.2 * FIRST_S / TICK_S:
        return None
    return follow(case, kind, scene, None if case.links else Corner(plan).bound(draw)) | {"friction": draw.friction}


def follow(case: Case, kind: str, scene: Scene, least: np.ndarray | None) -> dict[str, np.ndarray | float]:
    """Errors of one contact's reports; angles degrees, lengths mm. `late`: those that count."""
    held = ContactFilter(**case.settings)
    start = first_touch(scene)
    bases, tilt = scene.bases[start:], scene.tilt[start:]
    found = held.run(bases, tilt)
    at = found.sample + start
    use = np.hypot(*scene.point[at].T) < TIP + REACH_M
    at = at[use]
    off = found.point[use] - scene.point[at]
    turn = np.degrees(found.normal_rad[use] - scene.normal[at])
    speed = np.hypot(*scene.velocity[at].T)
    after_s = found.sample[use] * TICK_S
    first_s = TICK_S * (lying(scene.point[start:, 0]) + LIES_TICKS) if "lying" in kind else FIRST_S
    across = np.column_stack([np.cos(scene.normal[at]), np.sin(scene.normal[at])])
    return {
        "after_s": after_s,
        "late": (after_s >= max(FIRST_S, first_s)) & found.sure[use],
        "refused": (after_s >= max(FIRST_S, first_s)) & ~found.sure[use],
        "off": 1e3 * np.hypot(*off.T),
        "stated": 1e3 * np.sqrt(np.trace(found.point_cov[use], axis1=1, axis2=2)),
        "least": least[at] if least is not None else np.full(len(at), np.nan),
        "inside": np.einsum("ki,kij,kj->k", off, np.linalg.inv(found.point_cov[use]), off) < NINETY_2,
        "turn": turn,
        "turn_inside": (turn / np.degrees(found.normal_sd[use])) ** 2 < NINETY_1,
        "published_inside": (turn / np.degrees(np.hypot(found.normal_sd[use], MODEL_RAD))) ** 2 < NINETY_1,
        "contour": 1e3 * np.abs((off * across).sum(axis=1)),
        "speed": (found.speed[use] - speed) / np.where(speed > 1e-9, speed, np.nan),
        "speed_inside": (found.speed[use] - speed) ** 2 < NINETY_1 * found.speed_sd[use] ** 2,
        "motion": np.array(found.motion)[use],
        "corner": found.corner[use],
        "taken": found.faced[use],
        "slip": found.slip[use],
        "slides": slides(scene, at),
        "cost_us": cost_us(held, bases, tilt),
    }


def cost_us(held: ContactFilter, bases: np.ndarray, tilt: np.ndarray) -> float:
    """CPU time of a sample in C, from a new contact on."""
    from crunchbot.native import doubles, ffi, lib, octets

    held.begin()
    count = len(tilt)
    good, made, middles = np.ones(count, np.uint8), ffi.new("struct nav_contact_answer[]", count), np.empty(count)
    columns = doubles(bases, "bases", (count, 3)), doubles(tilt, "tilt", (count, 2)), octets(good, "good", (count,))
    began = time.process_time()
    lib.nav_contact_filter_run(held.state, *columns, count, made, doubles(middles, "middles", (count,)), count)
    return 1e6 * (time.process_time() - began) / count


def slides(scene: Scene, at: np.ndarray) -> np.ndarray:
    """1 where the force lies on the edge of the friction cone over a block, 0 where inside (n,); nan: not known."""
    grip = np.convolve(scene.grip, np.ones(BLOCK) / BLOCK, "same")[at]
    return np.where(np.isfinite(grip), grip > EDGE, np.nan)


def first_touch(scene: Scene) -> int:
    return int(np.argmax(scene.point[:, 1] > 0))
