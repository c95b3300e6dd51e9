#!/usr/bin/env python3
"""Draws whisker.svg: section through follicle, plug, magnet and chip with measures, the whisker, and the field at the sensor.

.venv/bin/python hardware/whisker/drawing.py        # writes whisker.svg beside this file; --out FILE to another
"""

import argparse
import math
from html import escape
from pathlib import Path

import numpy as np
from mount import COUNTS_PER_DEGREE, HERE, Mount

SECTION = 5.0  # scale of the section
AXIS, BOARD = 90.0, 176.0  # the whisker's axis and the board's surface on the page, mm
LINE, TEXT = 0.25, 2.8
TILTS = (0, 2, 5, 10, 15)


class Page:
    """Elements of an A4 page across, in mm."""

    def __init__(self):
        self.parts: list[str] = []

    def path(self, points, fill="none", stroke="black", width=LINE, dash="", closed=True, name=""):
        steps = " ".join(f"{'L' if n else 'M'}{x:.3f},{y:.3f}" for n, (x, y) in enumerate(points))
        style = f'fill="{fill}" stroke="{stroke}" stroke-width="{width}"' + (
            f' stroke-dasharray="{dash}"' if dash else ""
        )
        label = f' id="{name}"' if name else ""
        self.parts.append(f'<path{label} d="{steps}{" Z" if closed else ""}" {style}/>')

    def line(self, *points, **style):
        self.path(points, closed=False, **style)

    def text(self, x, y, words, anchor="start", size=TEXT, weight="normal"):
        self.parts.append(f'<text x="{x:.2f}" y="{y:.2f}" font-size="{size}" text-anchor="{anchor}" '
                          f'font-weight="{weight}">{escape(words)}</text>')  # fmt: skip

    def arrow(self, x, y, dx, dy):
        self.path([(x, y), (x - 2 * dx - 0.5 * dy, y - 2 * dy - 0.5 * dx), (x - 2 * dx + 0.5 * dy, y - 2 * dy + 0.5 * dx)],
                  fill="black", width=0)  # fmt: skip

    def across(self, x0, x1, y, words, reach=None):
        """A level measure at height y; reach: where the two lines to the part begin."""
        for x in (x0, x1):
            if reach is not None:
                self.line((x, reach), (x, y + math.copysign(1, y - reach)), width=0.13)
        self.line((x0, y), (x1, y), width=0.13)
        self.arrow(x0, y, -1, 0)
        self.arrow(x1, y, 1, 0)
        self.text((x0 + x1) / 2, y - 0.8, words, "middle")

    def svg(self) -> str:
        head = ('<svg xmlns="http://www.w3.org/2000/svg" width="297mm" height="210mm" viewBox="0 0 297 210" '
                'font-family="DejaVu Sans, Arial, sans-serif">')  # fmt: skip
        white = '<rect width="297" height="210" fill="white"/>'
        return "\n".join([head, white, *self.parts, "</svg>"]) + "\n"


def at(x: float, z: float) -> tuple[float, float]:
    """A point of the section (mm from the axis, mm above the board) on the page."""
    return AXIS + SECTION * x, BOARD - SECTION * z


def both(page: Page, outline, name: str, fill: str):
    """A part's section on both sides of the axis."""
    for sign, side in ((1, "right"), (-1, "left")):
        page.path([at(sign * x, z) for x, z in outline], fill, name=f"{name}-{side}")


def tilted(mount: Mount, points, degrees: float):
    """Points turned about the pivot, as the whisker leans to +x."""
    angle = math.radians(degrees)
    for x, z in points:
        dz = z - mount.pivot
        yield at(x * math.cos(angle) + dz * math.sin(angle), mount.pivot + dz * math.cos(angle) - x * math.sin(angle))


def shaft(mount: Mount, end: float):
    """Outline of the whisker from its base to a height."""
    r0, r1 = mount.diameter(0) / 2, mount.diameter(end - mount.base) / 2
    return [(-r0, mount.base), (r0, mount.base), (r1, end), (-r1, end)]


def section(page: Page, mount: Mount):
    follicle, holder, plug = mount.given["follicle"], mount.given["holder"], mount.given["plug"]
    magnet = mount.given["magnet"]
    half, bore = follicle["flange"] / 2, mount.rim_radius
    cavity, _, ceiling = follicle["cavity"]
    page.path(
        [at(-half - 1.5, 0), at(half + 1.5, 0), at(half + 1.5, -1.6), at(-half - 1.5, -1.6)], "#cfe3cf", name="board"
    )
    page.path([at(-1.95, 0), at(1.95, 0), at(1.95, mount.given["chip"]["height"]), at(-1.95, mount.given["chip"]["height"])],
              "#777", name="chip")  # fmt: skip
    throat = follicle["throat"] / 2
    both(page, [(cavity / 2, 0), (half, 0), (half, follicle["flange_height"]), (bore + follicle["wall"], follicle["flange_height"]),
                (bore + follicle["wall"], mount.rim), (bore, mount.rim), (bore, mount.holder_bottom),
                (throat, mount.holder_bottom), (throat, ceiling), (cavity / 2, ceiling)], "follicle", "#e9dcc3")  # fmt: skip
    low, high = mount.holder_bottom, mount.holder_bottom + mount.holder_height
    outer, inner, lip = bore - holder["clearance"], plug["diameter"] / 2, plug["diameter"] / 2 - holder["lip"]
    z0, z1 = low + holder["lip_height"], high - holder["lip_height"]
    both(page, [(outer, low), (outer, high), (lip, high), (lip, z1), (inner, z1), (inner, z0), (lip, z0), (lip, low)],
         "holder", "#c9d7ee")  # fmt: skip
    core = [mount.diameter(z - mount.base) / 2 for z in (z0, z1)]
    both(page, [(inner, z0), (inner, z1), (core[1], z1), (core[0], z0)], "plug", "#f3c9a5")
    end = mount.rim + 2.2
    page.path([at(*point) for point in shaft(mount, end)], "#bbb", name="whisker")
    r, bottom = magnet["diameter"] / 2, mount.magnet_bottom
    body = [(-r, bottom), (r, bottom), (r, mount.base), (-r, mount.base)]
    page.path([at(*point) for point in body], "#d66", name="magnet")
    for outline in (shaft(mount, mount.rim + 1.2), body):
        page.path(list(tilted(mount, outline, mount.stop)), stroke="#a00", dash="1 0.7", width=0.2)
    page.line(at(0, -2.2), at(0, mount.rim + 3.2), width=0.13, dash="3 0.8 0.6 0.8")
    x, y = at(0, mount.pivot)
    page.line((x - 2, y), (x + 2, y), stroke="#06c", width=0.4)
    x, y = at(0, mount.sensor)
    page.line((x - 2, y), (x + 2, y), stroke="#fff", width=0.4)


def heights(page: Page, mount: Mount):
    """Heights above the board, each with a line from its place; the texts stand apart."""
    holder = mount.holder_bottom
    rows = [
        (mount.sensor, "sensor", 2), (mount.given["chip"]["height"], "package, top", 2),
        (mount.magnet_bottom, "magnet, underside", 1), (mount.base, "magnet top, whisker's base", 1),
        (holder, "plug's holder, seat", 5), (mount.pivot, "pivot: middle of the plug", 1),
        (holder + mount.holder_height, "plug's holder, top", 5), (mount.rim, "rim", 7),
    ]  # fmt: skip
    last = BOARD + 9
    for z, words, reach in rows:
        y = at(0, z)[1]
        last = min(y, last - 4.2)
        left = at(-reach, z)[0]
        page.line((left, y), (42, y), (38, last), (8, last), width=0.13)
        page.text(8, last - 0.6, f"{z:.2f}", size=2.4, weight="bold")
        page.text(15.5, last - 0.6, words, size=2.0)
    page.text(8, 34, "Heights above the board, mm", size=2.6, weight="bold")


def widths(page: Page, mount: Mount):
    follicle, plug = mount.given["follicle"], mount.given["plug"]
    throat = follicle["throat"] / 2
    bore, half = mount.rim_radius, follicle["flange"] / 2
    top = at(0, mount.rim)[1]
    page.across(at(-bore, 0)[0], at(bore, 0)[0], top - 18, f"bore {2 * bore:.2f} dia.", top)
    outer = bore + follicle["wall"]
    page.across(at(-outer, 0)[0], at(outer, 0)[0], top - 24, f"{2 * outer:.2f} dia.", top)
    page.across(at(-half, 0)[0], at(half, 0)[0], BOARD + 25, f"{follicle['flange']:.1f} square", BOARD)
    pitch = follicle["hole_pitch"] / 2
    page.across(at(-pitch, 0)[0], at(pitch, 0)[0], BOARD + 19,
                f"4 holes {follicle['hole']:.1f} dia., {2 * pitch:.1f} square", BOARD + 9)  # fmt: skip
    page.across(at(-throat, 0)[0], at(throat, 0)[0], BOARD + 13,
                f"throat {follicle['throat']:.1f} dia.", at(0, follicle["cavity"][2])[1])  # fmt: skip
    notes = [
        (follicle["cavity"][0] / 2 - 0.7, 1.6, f"cavity {follicle['cavity'][0]:.1f} x {follicle['cavity'][1]:.1f} x "
                                       f"{follicle['cavity'][2]:.1f} high"),
        (plug["diameter"] / 2 - 0.6, mount.pivot, f"plug {plug['diameter']:.1f} dia. x {plug['length']:.1f}, polyurethane"),
        (mount.given["magnet"]["diameter"] / 2, mount.magnet_centre,
         f"magnet {mount.given['magnet']['diameter']:.1f} dia. x {mount.given['magnet']['thickness']:.1f}, NdFeB N42"),
        (bore - 0.6, mount.holder_bottom + mount.holder_height - 0.3, "plug's holder, printed; M2 screw in its side"),
        (half - 1, follicle["flange_height"] - 0.6, f"follicle, printed; flange {follicle['flange_height']:.1f} high"),
    ]  # fmt: skip
    for (x, z, words), row in zip(notes, (180, 156, 164, 148, 172), strict=True):
        page.line(at(x, z), (146, row), (149, row), width=0.13)
        page.text(150, row + 1, words, size=2.4)
    angle = math.radians(mount.stop)
    x, y = at(math.tan(angle) * (mount.rim - mount.pivot + 1.2), mount.rim + 1.2)
    page.text(x + 5, y - 1, f"stop at {mount.stop:.0f} degrees", size=2.4)


def whisker(page: Page, mount: Mount):
    """The whisker at its real size."""
    x0, y = 129.0, 133.5
    x1, exit_ = x0 + mount.whisker_length, x0 + mount.whisker_length - mount.whisker_outside
    r0, r1 = mount.base_diameter / 2, mount.tip_diameter / 2
    page.path([(x0, y - r0), (x1, y - r1), (x1, y + r1), (x0, y + r0)], "#bbb")
    page.across(x0, x1, y + 9, f"{mount.whisker_length:.0f}", y + 1)
    page.across(x0, exit_, y - 4, f"{mount.whisker_length - mount.whisker_outside:.0f} inside", y - 1)
    page.across(exit_, x1, y - 4, f"{mount.whisker_outside:.0f} outside the follicle", y - 1)
    page.text(x0, y + 4.2, f"{mount.base_diameter:.2f} dia.", size=2.4)
    page.text(exit_, y + 4.2, f"{mount.diameter(mount.whisker_length - mount.whisker_outside):.2f} dia.", size=2.4)
    page.text(x1, y + 4.2, f"{mount.tip_diameter:.2f} dia.", "end", size=2.4)
    page.text(x0 + 75, y + 14, "Whisker, scale 1:1, straight taper", size=2.6, weight="bold")


def field(page: Page, mount: Mount):
    """Strength and angle of the field over the tilt, drawn and as a table."""
    chip, magnet = mount.given["chip"], mount.given["magnet"]
    low, high = magnet["remanence_low"], magnet["remanence_high"]
    x0, y0, width, height, top = 160.0, 78.0, 118.0, 46.0, 80.0
    tilts = np.linspace(-mount.stop, mount.stop, 61)

    def spot(tilt, value, most):
        return x0 + width * (tilt + mount.stop) / (2 * mount.stop), y0 - height * value / most

    band = [spot(tilt, value, top) for tilt, value in
            ((-mount.stop, 1e3 * chip["field_low"]), (mount.stop, 1e3 * chip["field_low"]),
             (mount.stop, 1e3 * chip["field_high"]), (-mount.stop, 1e3 * chip["field_high"]))]  # fmt: skip
    page.path(band, "#e5f2e5", stroke="#9c9", width=0.13)
    page.line((x0, y0 - height), (x0, y0), (x0 + width, y0), (x0 + width, y0 - height))
    for remanence in (low, high):
        page.line(
            *[spot(t, 1e3 * float(np.hypot(*mount.field(t, remanence))), top) for t in tilts], stroke="#a00", width=0.4
        )
    page.line(*[spot(t, mount.field_angle(t) + 45, 90) for t in tilts], stroke="#06c", width=0.4)
    for tilt in range(-15, 16, 5):
        page.text(spot(tilt, 0, 1)[0], y0 + 4, f"{tilt}", "middle", 2.4)
    for value in range(0, 81, 20):
        page.text(x0 - 1.5, spot(0, value, top)[1] + 1, f"{value}", "end", 2.4)
    for value in range(-45, 46, 15):
        page.text(x0 + width + 1.5, spot(0, value + 45, 90)[1] + 1, f"{value}", "start", 2.4)
    page.text(x0 + width / 2, y0 + 8, "tilt of the whisker in its plug, degrees", "middle", 2.4)
    page.text(x0 - 6, y0 - height - 6.4, "Field at the sensor by the dipole formula", size=2.8, weight="bold")
    page.text(x0 - 6, y0 - height - 2.4, f"red: strength, mT, for Br {low:.2f} and {high:.2f} T; green: what the sensor wants; "
              "blue: angle of the field, degrees", size=2.2)  # fmt: skip
    head = ("tilt", f"mT, {low:.2f} T", f"mT, {high:.2f} T", "angle of the field", "counts from the middle")
    columns = (160, 182, 207, 237, 276)
    for column, words in zip(columns, head, strict=True):
        page.text(column, 94, words, "end", 2.4, "bold")
    for row, tilt in enumerate(TILTS):
        values = [1e3 * float(np.hypot(*mount.field(tilt, remanence))) for remanence in (low, high)]
        angle = mount.field_angle(tilt) + 0  # no minus sign before 0
        cells = (
            f"{tilt} deg",
            f"{values[0]:.1f}",
            f"{values[1]:.1f}",
            f"{angle:.2f} deg",
            f"{angle * COUNTS_PER_DEGREE:.0f}",
        )
        for column, words in zip(columns, cells, strict=True):
            page.text(column, 98.2 + 4 * row, words, "end", 2.4)
    gain = -mount.field_angle(0.01) / 0.01
    lines = [
        f"For small tilts the field turns by {gain:.2f} times the tilt: (1 + 3 {mount.pivot_to_magnet:.1f} / {mount.magnet_to_sensor:.1f}) / 2, "
        "to the other side.",
        f"At rest the disc itself gives {1e3 * mount.on_axis(low):.1f} to {1e3 * mount.on_axis(high):.1f} mT, "
        f"the dipole formula {1e3 * mount.field(0, low)[1]:.1f} to {1e3 * mount.field(0, high)[1]:.1f} mT.",
    ]  # fmt: skip
    for row, words in enumerate(lines):
        page.text(154, 118.4 + 3.6 * row, words, size=2.2)


def draw(mount: Mount) -> str:
    page = Page()
    page.path([(5, 5), (292, 5), (292, 205), (5, 205)], width=0.4)
    page.text(10, 13, "Whisker, plug, magnet and follicle over the node board", size=4.5, weight="bold")
    page.text(10, 19, f"Measures in mm. Section, scale {SECTION:.0f}:1, at rest (solid) and at the stop (dashed). "
              "NOT YET BUILT: nothing here has been measured.", size=2.8)  # fmt: skip
    page.text(
        10, 23.5, "Made by hardware/whisker/drawing.py from mount.toml and sim/mechanics/whisker_constants.h.", size=2.4
    )
    section(page, mount)
    heights(page, mount)
    widths(page, mount)
    whisker(page, mount)
    field(page, mount)
    return page.svg()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=HERE / "whisker.svg")
    parser.parse_args().out.write_text(draw(Mount.read()), encoding="utf-8")


if __name__ == "__main__":
    main()
