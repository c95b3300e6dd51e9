#!/usr/bin/env python3
"""The printable parts, follicle and plug_holder, as watertight STL in mm, from mount.toml. Wants manifold3d.

.venv/bin/python hardware/whisker/printed.py --out build/hardware
"""

import argparse
from pathlib import Path

import numpy as np
from manifold3d import Manifold
from mount import Mount

FACETS = 96
PAST = 0.5  # mm by which a cut goes past the face that it opens


def bore(diameter: float, bottom: float, top: float, x: float = 0, y: float = 0) -> Manifold:
    """An upright cylinder."""
    return Manifold.cylinder(top - bottom, diameter / 2, circular_segments=FACETS).translate((x, y, bottom))


def follicle(mount: Mount) -> Manifold:
    """Flange over the sensor and tube around the plug's holder; stands on the board, height 0."""
    measures = mount.given["follicle"]
    flange, wall = measures["flange"], measures["wall"]
    body = Manifold.cube((flange, flange, measures["flange_height"]), True).translate(
        (0, 0, measures["flange_height"] / 2)
    )
    body += bore(2 * (mount.rim_radius + wall), 0, mount.rim)
    body -= bore(2 * mount.rim_radius, mount.holder_bottom, mount.rim + PAST)
    body -= bore(measures["throat"], -PAST, mount.holder_bottom + PAST)
    x, y, height = measures["cavity"]
    body -= Manifold.cube((x, y, height + PAST), True).translate((0, 0, (height - PAST) / 2))
    half = measures["hole_pitch"] / 2
    for sx in (-half, half):
        for sy in (-half, half):
            body -= bore(measures["hole"], -PAST, measures["flange_height"] + PAST, sx, sy)
    screw = bore(measures["screw"], 0, flange).rotate((0, 90, 0))
    return body - screw.translate((0, 0, mount.holder_bottom + mount.holder_height / 2))


def plug_holder(mount: Mount) -> Manifold:
    """Ring with a lip at both ends, in which the plug is cast around the whisker; stands on height 0."""
    measures, plug = mount.given["holder"], mount.given["plug"]
    height, lip = mount.holder_height, measures["lip_height"]
    ring = bore(2 * (mount.rim_radius - measures["clearance"]), 0, height)
    ring -= bore(plug["diameter"] - 2 * measures["lip"], -PAST, height + PAST)
    return ring - bore(plug["diameter"], lip, height - lip)


PARTS = {"follicle": follicle, "plug_holder": plug_holder}


def triangles(solid: Manifold) -> np.ndarray:
    """Corners of all triangles, mm, shape (n, 3, 3)."""
    mesh = solid.to_mesh()
    return np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts)]


def write_stl(path: Path, solid: Manifold) -> None:
    """Binary STL."""
    corners = triangles(solid).astype("<f4")
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    rows = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
    rows["corners"] = corners
    rows["normal"] = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    head = b"CrunchBot, mm, not yet built".ljust(80)
    path.write_bytes(head + np.uint32(len(rows)).tobytes() + rows.tobytes())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder for the STL files")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    mount = Mount.read()
    for name, make in PARTS.items():
        write_stl(given.out / f"{name}.stl", make(mount))


if __name__ == "__main__":
    main()
