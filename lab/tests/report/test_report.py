"""The report from a small made-up run: complete, self-contained, and honest about what it is given."""

import asyncio
import base64
import json
import re
from contextlib import closing

import chromium
import numpy as np
import pytest

from crunchbot.recording.writing import TopicWriter
from crunchbot.robot.bags.played import RECORD
from crunchbot.robot.network.messages import SCHEMAS, Belief, Header, Time, encode
from crunchbot_lab.report import figures, html, motion, origin, write_report
from crunchbot_lab.report.run import FILTERS, Run

ROWS = 40
TEXTURES = ["VINYL", "SMOOTH", "ROUGH"]

SUMMARY = {
    "seed": 7, "simulated_s": 4.0, "wall_s": 5.0, "chain_wall_s": 2.0, "lanes": 4, "frames_sent": 8000, "frames_received": 8000,
    "frames_lost": 0, "records_bad_injected": 11, "records_bad_reported": 11, "records_bad_match": True, "usb_faults_injected": 3,
    "texture_accuracy": 0.95, "texture_accuracy_all": 0.9, "texture_windows_share": 0.5,
    "radial_std_mm": {"object_1": 5.5, "object_2": 2.5}, "radial_std_predicted_mm": {"object_1": 5.6, "object_2": 2.8},
    "pose_error_median_m": 0.05, "pose_error_p90_m": 0.11, "heading_error_median_rad": 0.04,
    "odometry_error_median_m": 0.25, "foveal_error_median_m": 0.12, "adaptive_error_median_m": 0.018,
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


ORIGIN = {
    "command": "python -m crunchbot_lab.demo --seed 7 <x>", "commit": "0123456789ab", "version": "9.8.7",
    "machine": "an abacus, 2 processors, load 0.1", "date": "2026-01-02 03:04 UTC",
}  # fmt: skip
AT = (0.25, 0.75, -3.0)  # of the belief in the bag, from row 11 on


def write_bag(path):
    """A bag with two beliefs of the grid, of rows 0 and 11."""
    rng = np.random.default_rng(5)
    with closing(TopicWriter(path, RECORD, {"robot": "robot"})) as writer:
        writer.topic("/robot/belief", SCHEMAS[Belief])
        for seq in (0, 11):
            n = 500
            columns = [(at + 0.01 * rng.standard_normal(n)).astype("f4") for at in AT]
            widths = [np.full(n, value, "f4") for value in (1 / n, 0.02, 0.05)]
            belief = Belief(Header(Time(seq, 0), "map"), "grid", seq, 4321 + seq, 1.0, *columns, *widths)
            writer.add("/robot/belief", seq, encode(belief))
        writer.finish()


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
    (tmp_path / "origin.json").write_text(json.dumps(ORIGIN))
    seeds = {f"{name}_m": [0.1, 0.2, 0.3] for name in ("grid", "adaptive", "foveal", "odometry")}
    write_csv(tmp_path / "seeds.csv", {"seed": [7, 8, 9]} | seeds)
    write_bag(tmp_path / "robot.mcap")
    return tmp_path


def test_page_is_complete_and_self_contained(run_folder):
    page = write_report(run_folder).read_text()
    assert page.count("<svg") == 8, "four figures, wide and narrow"
    fetched = re.findall(r'(?:src|href)\s*=\s*"(?!#)[^"]*"|url\((?!#)[^)]*\)|@import', page)
    assert fetched == []
    for text in ("position error (m)", "heading error (degrees)", "radial distance (mm)", "time (s)", "deflection"):
        assert text in page


def test_page_shows_the_summary_beside_the_paper(run_folder):
    page = write_report(run_folder).read_text()
    for text in ("5.50", "5.60", "5.68", "2.78", "95.0 %", "8,000", ">equal<", "11 of 11"):
        assert text in page


def test_page_reports_of_base_network_and_bag(run_folder):
    page = write_report(run_folder).read_text()
    for text in (
        "iRobot Create 1",
        "sensor frames of 15 ms, whole</th><td>266<",
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


def test_the_result_comes_first_and_command_seed_commit_machine_and_date_last(run_folder):
    page = write_report(run_folder).read_text()
    assert page.index("median position error by touch") < page.index('class="tiles"') < page.index('id="motion-card"')
    foot = page[page.index("Throughput, loss, base") :]
    for text in (
        "--seed 7 &lt;x&gt;",
        "0123456789ab, version 9.8.7",
        "an abacus",
        "2026-01-02 03:04 UTC",
        "<dd>7</dd>",
    ):
        assert text in foot


def test_every_figure_has_its_words_and_every_filter_its_sentence(run_folder):
    page = write_report(run_folder).read_text()
    spoken = re.findall(r'<svg role="img" aria-label="([^"]{60,})"', page)
    assert len(spoken) == page.count("<svg") and len(set(spoken)) == 4
    assert any("grid (eq. 4): median 0.02 m and 1 degrees" in words for words in spoken)
    assert len(re.findall(r"<div><dt>[^<]+</dt><dd>[^<]{60,}</dd></div>", page)) == len(FILTERS)


def test_seeds_stand_beside_the_run_only_if_they_were_replayed(run_folder):
    page = write_report(run_folder).read_text()
    assert "Seeds 7 to 9" in page and "Medians of 3 seeds" in page
    (run_folder / "seeds.csv").unlink()
    page = write_report(run_folder).read_text()
    assert "Other seeds" not in page and "seeds:" not in page


def test_figures_have_the_colours_of_the_page_and_no_others(run_folder):
    run = Run.load(run_folder)
    for draw in (figures.arena, figures.errors, figures.texture, figures.radial, figures.spread):
        drawn = figures.svg(draw, run)
        assert re.search(r"#[0-9a-f]{6}\b", drawn)
        assert re.findall(r"(?:fill|stroke)[:=] *\"?(#[0-9a-f]{6})\b", html.themed(drawn)) == []
    used = set(re.findall(r"var\((--[a-z-]+)\)", html.style())) | set(html.THEMED.values())
    for scheme in html.style().split("@media (prefers-color-scheme: dark)")[:2]:
        assert used <= set(re.findall(r"(--[a-z-]+):", scheme))


def test_the_motion_has_every_row_and_the_beliefs_of_the_bag(run_folder):
    data = motion.data(Run.load(run_folder))
    assert [len(data["truth"])] + [len(data["filters"][name]["poses"]) for name in FILTERS] == [ROWS] * 5
    assert data["truth"][-1] == [4.0, 0.6, 0.25, 0.0]
    first, second = data["filters"]["grid"]["beliefs"]
    assert (first["row"], second["row"], second["total"], data["filters"]["foveal"]["beliefs"]) == (0, 11, 4332, [])
    numbers = np.frombuffer(base64.b64decode(second["poses"]), "<i2").reshape(-1, 6) * np.array(data["scales"])
    assert 1 < len(numbers) <= motion.COMPONENTS_MOST
    assert numbers[:, 3].sum() == pytest.approx(1.0, abs=0.01)
    assert np.average(numbers[:, :3], axis=0, weights=numbers[:, 3]) == pytest.approx(AT, abs=0.01)


def test_a_commit_is_of_this_tree_or_not_recorded(tmp_path):
    assert re.match(r"[0-9a-f]{12}(, changed)?$|not recorded$", origin.commit())
    assert origin.commit(tmp_path) == "not recorded"


SHOWN = """[...document.querySelectorAll('.plan')].map((box) => box.getAttribute('aria-label'))"""
BEYOND = """[...document.querySelectorAll('main .card > *, main .card table, main .tile, figure, header *')].filter((e) =>
  e.offsetParent && (e.getBoundingClientRect().right > innerWidth - 8 || e.scrollWidth > e.clientWidth + 1 && e.clientWidth)
).map((e) => e.outerHTML.slice(0, 90))"""


@pytest.mark.skipif(chromium.PROGRAM is None, reason="chromium is not installed (apt install chromium)")
def test_in_a_browser_light_and_dark_wide_and_on_a_telephone(run_folder):
    async def scenario():
        papers = {}
        for scheme in ("light", "dark"):
            for width in (1280, 390):
                async with chromium.browser() as b:
                    media = [{"name": "prefers-color-scheme", "value": scheme}]
                    await b.call("Emulation.setEmulatedMedia", features=media)
                    await b.look(f"file://{path}", width)
                    assert await b.eval("document.documentElement.scrollWidth") == width
                    assert await b.eval(BEYOND) == []
                    papers[scheme] = await b.eval("getComputedStyle(document.body).backgroundColor")
                    seen = await b.eval(
                        "[...document.querySelectorAll('figure svg')].filter((s) => s.clientWidth).length"
                    )
                    assert seen == 4
                    await moves(b)
                    assert b.troubles == [] and b.requests == [f"file://{path}"]
        assert papers["light"] != papers["dark"]

    async def moves(b):
        await b.until("motion.playing === false && motion.row === motion.last")  # it plays once by itself
        end = await b.eval(SHOWN)
        assert len(end) == 4 and "4.0 s" in end[0] and "odometry alone says x 0.80 m" in end[3]
        at = "const t = document.getElementById('motion-time'); t.value = {}; t.dispatchEvent(new Event('input'))"
        await b.eval(f"{{ {at.format(11)} }}")
        assert "4\u202f332 poses in one place" in (await b.eval(SHOWN))[0], "the belief of the row itself"
        await b.eval(f"{{ {at.format(9)} }}")
        then = await b.eval(SHOWN)
        assert (
            "1.0 s. True place x 0.30 m, y 0.25 m; grid (eq. 4) says x 0.32 m, y 0.25 m, 0.02 m and 1° off" in then[0]
        )
        assert "4\u202f321 poses in one place" in then[0] and "no belief was recorded" in then[1]
        await b.eval(
            "document.getElementById('motion-speed').value = 16; document.getElementById('motion-play').click()"
        )
        await b.until("motion.playing === false && motion.row === motion.last")

    path = write_report(run_folder)
    asyncio.run(scenario())
