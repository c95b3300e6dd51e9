"""Measures of whisker, plug, magnet and follicle in mm, and the magnet's field at the sensor. Height 0 is the board's surface."""

import math
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
CONSTANTS = HERE.parent.parent / "sim/mechanics/whisker_constants.h"
COUNTS_PER_DEGREE = 65536 / 180


def constants(path: Path = CONSTANTS) -> dict[str, float]:
    """The plain numbers of the simulation's header, by name, in its units (SI; degrees times SIM_DEGREE stay degrees)."""
    text = path.read_text(encoding="utf-8")
    return {name: float(value) for name, value in
            re.findall(r"^#define (SIM_\w+) \(?([-+.\deE]+)(?: \* SIM_DEGREE\))?(?=\s|$)", text, re.MULTILINE)}  # fmt: skip


@dataclass(frozen=True)
class Mount:
    """All measures; made by `Mount.read`. Lengths mm, angles degrees, remanence and field T."""

    given: dict
    whisker_length: float
    whisker_outside: float
    base_diameter: float
    tip_diameter: float
    stop: float
    pivot_to_magnet: float
    magnet_to_sensor: float

    @staticmethod
    def read(path: Path = HERE / "mount.toml", header: Path = CONSTANTS) -> "Mount":
        """Reads both files; ValueError names what contradicts what."""
        known = constants(header)
        mount = Mount(
            tomllib.loads(path.read_text(encoding="utf-8")),
            1000 * known["SIM_WHISKER_TOTAL_M"], 1000 * known["SIM_WHISKER_OUTSIDE_M"],
            1000 * known["SIM_WHISKER_BASE_DIAMETER"], 1000 * known["SIM_WHISKER_TIP_DIAMETER"],
            known["SIM_PLUG_STOP"], 1000 * known["SIM_MAGNET_PIVOT_M"], 1000 * known["SIM_MAGNET_GAP_M"],
        )  # fmt: skip
        mount.check(path.name)
        return mount

    def check(self, name: str) -> None:
        """Refuses measures with which the parts do not fit into each other."""
        if not 0 < self.element_depth < self.given["chip"]["height"]:
            raise ValueError(f"{name}: chip.air_gap: the sensor would lie {self.element_depth:.2f} mm under the package's top; "
                             "change air_gap or magnet.thickness")  # fmt: skip
        if self.throat_needed > self.given["follicle"]["throat"]:
            raise ValueError(
                f"{name}: follicle.throat: the tilted magnet needs {self.throat_needed:.2f} mm; make it wider"
            )
        if self.holder_bottom < self.given["follicle"]["cavity"][2]:
            raise ValueError(f"{name}: follicle.cavity: it cuts into the holder's seat; make it lower")

    def diameter(self, s: float) -> float:
        """The whisker's diameter, s mm from its base."""
        return self.base_diameter + (self.tip_diameter - self.base_diameter) * s / self.whisker_length

    @property
    def magnet_bottom(self) -> float:
        return self.given["chip"]["height"] + self.given["chip"]["air_gap"]

    @property
    def magnet_centre(self) -> float:
        return self.magnet_bottom + self.given["magnet"]["thickness"] / 2

    @property
    def base(self) -> float:
        """The whisker's base: it stands on the magnet."""
        return self.magnet_bottom + self.given["magnet"]["thickness"]

    @property
    def sensor(self) -> float:
        return self.magnet_centre - self.magnet_to_sensor

    @property
    def element_depth(self) -> float:
        """How deep the Hall elements are taken to lie under the package's top."""
        return self.given["chip"]["height"] - self.sensor

    @property
    def pivot(self) -> float:
        return self.magnet_centre + self.pivot_to_magnet

    @property
    def rim(self) -> float:
        """The follicle's end, where the whisker leaves it."""
        return self.base + self.whisker_length - self.whisker_outside

    @property
    def rim_radius(self) -> float:
        """Bore in which the whisker meets the rim at the stop's angle."""
        angle = math.radians(self.stop)
        radius = self.diameter(self.whisker_length - self.whisker_outside) / 2
        return (self.rim - self.pivot) * math.tan(angle) + radius / math.cos(angle)

    @property
    def holder_bottom(self) -> float:
        return self.pivot - self.given["plug"]["length"] / 2 - self.given["holder"]["lip_height"]

    @property
    def holder_height(self) -> float:
        return self.given["plug"]["length"] + 2 * self.given["holder"]["lip_height"]

    @property
    def throat_needed(self) -> float:
        """Bore that the magnet needs when it is tilted to the stop, with 0.2 mm to spare all round."""
        angle = math.radians(self.stop)
        reach = self.pivot - self.magnet_bottom
        return 2 * (reach * math.sin(angle) + self.given["magnet"]["diameter"] / 2 * math.cos(angle) + 0.2)

    def moment(self, remanence: float) -> float:
        """Br V / (4 pi), T mm^3: the dipole's field is this times (3 (m r) r - m) / r^3 with unit vectors m, r."""
        magnet = self.given["magnet"]
        return remanence * math.pi * (magnet["diameter"] / 2) ** 2 * magnet["thickness"] / (4 * math.pi)

    def field(self, tilt_deg: float, remanence: float) -> np.ndarray:
        """Field at the sensor (x along the tilt, z along the axis), T, by the dipole formula, for a tilt of the whisker."""
        angle = math.radians(tilt_deg)
        axis = np.array([math.sin(angle), math.cos(angle)])  # of the magnet; the whisker leans to +x
        centre = np.array([0.0, self.pivot]) - self.pivot_to_magnet * axis
        r = np.array([0.0, self.sensor]) - centre
        distance = float(np.hypot(*r))
        unit = r / distance
        return self.moment(remanence) * (3 * float(axis @ unit) * unit - axis) / distance**3

    def on_axis(self, remanence: float) -> float:
        """Field at the sensor with the whisker at rest, T, of the disc itself: what the dipole formula stands for."""
        magnet = self.given["magnet"]
        near = self.magnet_to_sensor - magnet["thickness"] / 2
        far, radius = near + magnet["thickness"], magnet["diameter"] / 2
        return remanence / 2 * (far / math.hypot(far, radius) - near / math.hypot(near, radius))

    def field_angle(self, tilt_deg: float) -> float:
        """Angle of the field from the axis, degrees, with the tilt's sign turned: the magnet swings to the other side."""
        x, z = self.field(tilt_deg, 1.0)
        return math.degrees(math.atan2(x, z))
