"""The table [base] of robot.toml: what a base can do, and by which topics of ROS 2 it is driven. Without it: a Create's."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from . import scene_table

TOUCHES = ("bump_left", "bump_right", "cliff_left", "cliff_right", "wheel_drop")
COMMAND_TYPES = ("Twist", "TwistStamped")
MOST_M, MOST_M_S, MOST_M_S2 = 5.0, 5.0, 100.0  # more is in other units; speeds: a row takes no more (intake.c)


@dataclass(frozen=True)
class Topics:
    """Names in ROS 2. command_type: where the graph does not say it. touch: of std_msgs/Bool, by what is touched."""

    command: str = "/cmd_vel"
    odometry: str = "/odom"
    command_type: str = ""
    frame: str = "base_link"
    touch: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class BaseTable:
    """Of the wheels: distance apart, greatest speed, the step of speeds and the least; how fast their speed may change."""

    # A Create of either model: 0.5 m/s, and the narrower wheel base, 2's (protocol/create_oi.h).
    wheel_base_m: float = 0.235
    wheel_most_m_s: float = 0.5
    wheel_step_m_s: float = 0.001
    acceleration_m_s2: float | None = None  # None: the base sees to it
    topics: Topics | None = None  # None: a Create on its serial line

    @property
    def turn_most_rad_s(self) -> float:
        return 2.0 * self.wheel_most_m_s / self.wheel_base_m

    def wheel_m_s(self, v_m_s: float, omega_rad_s: float) -> float:
        """Speed of the faster wheel."""
        return abs(v_m_s) + abs(omega_rad_s) * self.wheel_base_m / 2.0

    def reached(self, v_m_s: float, omega_rad_s: float) -> tuple[float, float]:
        """Speeds on the same curve that no wheel is too slow for."""
        wheel_m_s = self.wheel_m_s(v_m_s, omega_rad_s)
        share = min(1.0, self.wheel_most_m_s / wheel_m_s) if wheel_m_s else 1.0
        return share * v_m_s, share * omega_rad_s


CREATE = BaseTable()


def read_base(table: "scene_table.Table") -> BaseTable:
    """Of robot.toml, whose other keys stay."""
    if "base" not in table.content:
        return CREATE
    part = table.within("base")
    numbers = {
        "wheel_base_m": part.number("wheel_base_m", 1e-3, MOST_M),
        "wheel_most_m_s": part.number("wheel_most_m_s", 1e-3, MOST_M_S),
    }
    for name, most in (("wheel_step_m_s", numbers["wheel_most_m_s"]), ("acceleration_m_s2", MOST_M_S2)):
        if name in part.content:
            numbers[name] = part.number(name, 1e-4, most)
    topics = _topics(part.within("ros2")) if "ros2" in part.content else None
    part.done()
    return BaseTable(**numbers, topics=topics)


def base_content(base: BaseTable) -> dict:
    """The table that `read_base` reads back as an equal one; empty: it says nothing new."""
    if base == CREATE:
        return {}
    given = {key: value for key, value in vars(base).items() if key != "topics" and value is not None}
    topics = {key: value for key, value in vars(base.topics).items() if value} if base.topics else None
    return {"base": given | ({"ros2": topics} if topics else {})}


def _topics(table: "scene_table.Table") -> Topics:
    named = {key: _topic(table, key) for key in ("command", "odometry") if key in table.content}
    if "command_type" in table.content:
        named["command_type"] = table.text("command_type", *COMMAND_TYPES)
    if "frame" in table.content:
        named["frame"] = table.text("frame")
    touch = table.within("touch") if "touch" in table.content else None
    if touch:
        named["touch"] = {key: _topic(touch, key) for key in TOUCHES if key in touch.content}
        touch.done()
    table.done()
    return Topics(**named)


def _topic(table: "scene_table.Table", key: str) -> str:
    name = table.text(key)
    if not name.startswith("/") or not name.replace("/", "").replace("_", "").isalnum():
        raise table.fail(key, f"is '{name}', no topic; begin with / and use letters, digits and underscores")
    return name
