"""The report from a small made-up run: complete, self-contained, and honest about what it is given."""

import json
import re

import numpy as np
import pytest

from crunchbot_lab.report import figures, write_report
from crunchbot_lab.report.run import Run

ROWS = 40
TEXTURES = ["VINYL", "SMOOTH", "ROUGH"]

SUMMARY = {
    "seed": 7, "simulated_s": 4.0, "wall_s": 5.0, "chain_wall_s": 2.0, "lanes": 4, "frames_sent": 8000, "frames_received": 8000,
    "frames_lost": 0, "records_bad_injected": 11, "records_bad_reported": 11, "records_bad_match": True, "usb_faults_injected": 3,
    "texture_accuracy": 0.95, "texture_accuracy_all": 0.9, "texture_windows_share": 0.5,
    "radial_std_mm": {"object_1": 5.5, "object_2": 2.5}, "radial_std_predicted_mm": {"object_1": 5.6, "object_2": 2.8},
    "pose_error_median_m": 0.05, "pose_error_p90_m": 0.11, "heading_error_median_rad": 0.04,
    "odometry_error_median_m": 0.25, "foveal_error_median_m": 0.12,
}  # fmt: skip

ARENA = """size_m = [1.0, 1.0]
tile_m = 0.5
textures = ["VINYL", "SMOOTH", "ROUGH"]
floor = ["VS", "RV"]
[[obstacle]]
min_m = [0.5, 0.0]
max_m = [1.0, 0.5]
"""

ROBOT = """body_radius_m = 0.165
odometry_relative_sigma = 0.03
radial_sigma_m = 0.005
[[whisker]]
name = "left"
role = "texture"
tip_m = [-0.02, 0.21]
[[whisker]]
name = "right"
role = "texture"
tip_m = [-0.02, -0.21]
[[whisker]]
name = "object_1"
role = "object"
base_m = [0.1, 0.1]
yaw_rad = 0.0
length_m = 0.14
[[whisker]]
name = "object_2"
role = "object"
base_m = [0.1, -0.1]
yaw_rad = 0.0
length_m = 0.14
"""


def write_csv(path, columns):
    rows = zip(*columns.values(), strict=True)
    path.write_text("\n".join([",".join(columns), *(",".join(map(str, row)) for row in rows)]) + "\n")


@pytest.fixture
def run_folder(tmp_path):
    random = np.random.default_rng(1)
    (tmp_path / "scene").mkdir()
    (tmp_path / "scene/arena.toml").write_text(ARENA)
    (tmp_path / "scene/robot.toml").write_text(ROBOT)
    (tmp_path / "summary.json").write_text(json.dumps(SUMMARY))
    base = {"model": "1", "frames": "266", "corrupt": "0", "missed": "0", "angle_source": "requested"}
    (tmp_path / "pilot.json").write_text(json.dumps({"rows": ROWS, "whisks": [], "base": base}))
    navigator = {"weighed": ROWS, "skipped": 0, "missed": 0, "refused": 0}
    (tmp_path / "navigator.json").write_text(json.dumps(navigator))
    (tmp_path / "radial_lines.json").write_text(json.dumps({"object_1": [-0.036, 181.0], "object_2": [-0.036, 181.0]}))
    t = np.arange(1, ROWS + 1) * 0.1
    x = 0.2 + 0.1 * t
    names = ("left", "right")
    tiles = np.where(np.arange(ROWS) < 20, "VINYL", "ROUGH")
    truth = {"tick": np.arange(1, ROWS + 1) * 200 - 1, "x_m": x, "y_m": 0.25 + 0 * x, "theta_rad": 0 * x}
    truth |= (
        {f"{n}_tile": tiles for n in names}
        | {f"{n}_inside_mm": 60 + 0 * x for n in names}
        | {f"{n}_moved_mm": 10 + 0 * x for n in names}
    )
    write_csv(tmp_path / "truth.csv", truth)
    cells = {
        f"{n}_{c}": [str(v) if k % 3 else "" for k, v in enumerate(random.normal(-900, 50, ROWS))]
        for n in names
        for c in TEXTURES
    }
    write_csv(
        tmp_path / "scene/observations.csv",
        {"t_s": t, "odo_x_m": 0 * t, "odo_y_m": 0 * t, "odo_theta_rad": 0 * t} | cells,
    )
    for name, error in (("grid", 0.02), ("adaptive", 0.03), ("foveal", 0.05), ("odometry", 0.2)):
        write_csv(
            tmp_path / f"est_{name}.csv",
            {"t_s": t, "x_m": x + error, "y_m": 0.25 + 0 * x, "theta_rad": 0 * x + error, "confidence": 0 * x + 1},
        )
    write_csv(
        tmp_path / "covariance_grid.csv", {"t_s": t, "xx_m2": 0.001 + 0 * t, "xy_m2": 0 * t, "yy_m2": 0.002 + 0 * t}
    )
    radius = np.tile(np.arange(90, 141, 10), 4)
    whisker = ["object_1"] * 12 + ["object_2"] * 12
    write_csv(tmp_path / "radial_points.csv", {"whisker": whisker, "set": ["fit", "held out"] * 12, "radius_mm": radius,
                                               "peak_counts": (181.0 - radius) / 0.036, "predicted_mm": radius + 0.5})  # fmt: skip
    traces = {f"{n}_{e}_deg": v + 0 * t for n in names for e, v in (("min", 0.1), ("max", 0.9))}
    write_csv(tmp_path / "traces.csv", {"t_s": t} | traces)
    return tmp_path


def test_page_is_complete_and_self_contained(run_folder):
    page = write_report(run_folder).read_text()
    assert page.count("<svg") == 4
    fetched = re.findall(r'(?:src|href)\s*=\s*"(?!#)[^"]*"|url\((?!#)[^)]*\)|@import', page)
    assert fetched == []
    for text in ("position error (m)", "heading error (degrees)", "radial distance (mm)", "time (s)", "deflection"):
        assert text in page


def test_page_shows_the_summary_beside_the_paper(run_folder):
    page = write_report(run_folder).read_text()
    for text in ("5.50", "5.60", "5.68", "2.78", "95.0 %", "8,000", ">equal<"):
        assert text in page


def test_page_reports_of_base_network_and_bag(run_folder):
    page = write_report(run_folder).read_text()
    for text in (
        "iRobot Create 1",
        "sensor frames of 15 ms, whole</td><td>266<",
        "rows missed by the navigator",
        "robot.mcap",
    ):
        assert text in page


def test_unequal_fault_sets_are_not_called_equal(run_folder):
    (run_folder / "summary.json").write_text(json.dumps(SUMMARY | {"records_bad_match": False}))
    page = write_report(run_folder).read_text()
    assert "NOT EQUAL" in page and ">equal<" not in page


def test_deflection_is_drawn_no_higher_than_it_was(run_folder):
    """From the lowest to the highest of each moment: a line around that would add its own width."""
    for axes in figures.texture(Run.load(run_folder)).axes[1::2]:
        (band,) = axes.collections
        heights = band.get_paths()[0].vertices[:, 1]
        assert (heights.min(), heights.max()) == (0.1, 0.9) and not any(band.get_linewidth())


def test_same_run_same_page(run_folder):
    assert write_report(run_folder).read_text() == write_report(run_folder).read_text()
