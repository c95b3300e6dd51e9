"""What the contact filter says in scenes of each kind, beside the truth and the Cramer-Rao bound."""

import time
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from crunchbot.touch.contact_filter import ContactFilter

from .scenes import FRICTION_SD, QUARTER, REACH_M, TICK_S, TIP, Corner, Draw, Plan, Scene, chained, lying

FIRST_S = 0.1  # figures count from here on: the contact has moved by a centimetre at 0.1 m/s
NINETY_2, NINETY_1 = 4.605, 2.706  # chi-squared, 90 %, of two and of one degree of freedom
SPEED, WHISK = 0.1, np.pi / 24
TURN_BACK_S = 0.15
FLAT_M, CYLINDER_M = 5.0, 0.05  # radii
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


def face(rng) -> Plan:
    normal = rng.uniform(np.radians(97), np.radians(135))
    bases = straight(900, rng.uniform(0.05, SPEED), rng.uniform(-0.3, 0.3) + normal - QUARTER)
    return Plan(bases, standing(900), TIP, FLAT_M, normal)


def cylinder(rng) -> Plan:
    bases = straight(900, SPEED, 0.0)
    if rng.uniform() < 0.5:
        return Plan(bases, standing(900), rng.uniform(0.08, 0.13), CYLINDER_M)
    return Plan(bases, standing(900), TIP, CYLINDER_M, rng.uniform(np.radians(97), np.radians(118)))


def there_and_back(rng) -> Plan:
    """The tip pushed into a face and drawn back along the same way: it slides, sticks and slides back."""
    normal, times = rng.uniform(np.radians(105), np.radians(135)), np.arange(900) * TICK_S
    share = np.interp(times, [0.2, 0.3], [1.0, -1.0])
    bases = straight(900, rng.uniform(0.05, SPEED), rng.uniform(-0.3, 0.3) + normal - QUARTER)
    return Plan(bases * share[:, None], standing(900), TIP, FLAT_M, normal)


def head_on(rng) -> Plan:
    normal = rng.uniform(np.radians(145), np.radians(178))
    return Plan(straight(600, rng.uniform(0.05, SPEED), normal - QUARTER), standing(600), TIP, FLAT_M, normal)


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
    "face, there and back": there_and_back,
    "face, then lying along it": lambda rng: face(rng)._replace(lies=True),
    "face, head-on": head_on,
}
CHAINED = [kind for kind in KINDS if not kind.startswith("moving")]


class Case(NamedTuple):
    """What the filter is given, and what bends the whisker."""

    kinds: dict[str, Callable]
    links: bool = False

    @property
    def settings(self) -> dict[str, float]:
        """Of the filter."""
        return {"friction_sd": FRICTION_SD} | ({"creep": 0.0} if self.links else {})

    def drawn(self, kind: str, seed: int) -> tuple[Plan, Draw]:
        draw = Draw.of(1000 * list(KINDS).index(kind) + seed)
        return self.kinds[kind](draw.rng), draw


CASES = {
    "simulated": Case({kind: plan for kind, plan in KINDS.items() if "corner" in kind}),
    "chain": Case({kind: KINDS[kind] for kind in CHAINED}, links=True),
}


def true_motion(kind: str) -> str:
    return "sweep" if kind.startswith("moving") else "body whisk" if kind.endswith("whisk") else "drive-by"


def contacts(case: Case, kind: str, count: int) -> Iterator[tuple[Scene, np.ndarray | None]]:
    """Scenes of a kind, by the simulator or by a chain of links, and of corners the bound (n,) of the error, mm."""
    for seed in range(count):
        plan, draw = case.drawn(kind, seed)
        least = None
        if not case.links:
            least = Corner(plan).bound(draw, case.settings["friction_sd"])
        made = chained(plan, draw) if case.links else Corner(plan).scene(draw)
        if made is not None and len(made.tilt) > 1.2 * FIRST_S / TICK_S:
            yield made, least


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
    round_m = np.hypot(*(scene.point[at] - scene.centre[at]).T)
    contour = (
        np.hypot(*(found.point[use] - scene.centre[at]).T) - round_m
        if "cylinder" in kind
        else (off * across).sum(axis=1)
    )
    return {
        "after_s": after_s,
        "late": (after_s >= max(FIRST_S, first_s)) & (found.other[use] < 0.5),
        "refused": (after_s >= max(FIRST_S, first_s)) & (found.other[use] >= 0.5),
        "off": 1e3 * np.hypot(*off.T),
        "stated": 1e3 * np.sqrt(np.trace(found.point_cov[use], axis1=1, axis2=2)),
        "least": least[at] if least is not None else np.full(len(at), np.nan),
        "inside": np.einsum("ki,kij,kj->k", off, np.linalg.inv(found.point_cov[use]), off) < NINETY_2,
        "turn": turn,
        "turn_inside": (turn / np.degrees(found.normal_sd[use])) ** 2 < NINETY_1,
        "contour": 1e3 * np.abs(contour),
        "speed": (found.speed[use] - speed) / np.where(speed > 1e-9, speed, np.nan),
        "speed_inside": (found.speed[use] - speed) ** 2 < NINETY_1 * found.speed_sd[use] ** 2,
        "motion": np.array(found.motion)[use],
        "corner": found.corner[use],
        "taken": (found.tip[use] >= 0.9) & (found.sweep[use] < 0.5) & (found.other[use] < 0.5),
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
