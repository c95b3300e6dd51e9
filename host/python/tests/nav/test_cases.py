"""Scenes, rows and maps as people write them: each is read in silence as well as the plain one, or with a warning, or refused.

Right: no line, and the answers of the plain one unless the case is another world. A warning: an answer, and a line that names
the cause. Refused: no answer, exit code 2, and one line with file, place and remedy.
"""

import json
import math
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commandkit import run
from PIL import Image, ImageFilter

from crunchbot.nav.faults import row_faults
from crunchbot.nav.filters import Filter
from crunchbot.nav.fit import fit_faults
from crunchbot.nav.observations import joined, observations_path, observed, read_observations
from crunchbot.observation import Row
from crunchbot.occupancy import read_map
from crunchbot.robot.row_watch import ROWS, RowWatch
from crunchbot.scene import load

CASES = Path(__file__).parent / "cases"
RIGHT, OTHER_WORLD = "", "another world"
ROW = "observations.csv"
BOM = b"\xef\xbb\xbf"
NEAR_M = 0.02  # of the plain one's median error


def text(name, *pairs):
    """An edit that replaces texts in a file, each where it is first."""

    def edit(folder):
        data = (folder / name).read_bytes()
        for old, new in zip(pairs[::2], pairs[1::2], strict=True):
            old, new = (part.encode() if isinstance(part, str) else part for part in (old, new))
            assert old in data
            data = data.replace(old, new)
        (folder / name).write_bytes(data)

    return edit


def whole(name, change):
    """An edit of a file's bytes."""
    return lambda folder: (folder / name).write_bytes(change((folder / name).read_bytes()))


def lines(change):
    """An edit of each line of the rows, by its number, the header's 0."""
    return whole(ROW, lambda data: b"\n".join(change(*line) for line in enumerate(data.splitlines())) + b"\n")


def cells(change):
    """An edit of the cells of each row: change(number from 0, {column: text})."""

    def edit(data):
        header, *rows = data.decode().splitlines()
        names = header.split(",")
        out = [dict(zip(names, row.split(","), strict=True)) for row in rows]
        for n, row in enumerate(out):
            change(n, row)
        return "\n".join([header, *(",".join(row.values()) for row in out)]).encode() + b"\n"

    return whole(ROW, edit)


def stamps(stamp):
    return cells(lambda n, row: row.update(t_s=repr(stamp(0.1 * (n + 1), n))))


def motion(**columns):
    """An edit of row 151's motion."""
    return cells(
        lambda n, row: row.update({f"odo_{name}": value for name, value in columns.items()} if n == 150 else {})
    )


def factor(column, by):
    def change(_, row):
        for name in (name for name in row if re.fullmatch(column, name) and row[name]):
            row[name] = repr(float(row[name]) * by)

    return cells(change)


def distances(of):
    """An edit of the cells of distances: of(text, number of the row)."""
    return cells(lambda n, row: row.update({name: of(row[name], n) for name in row if name.endswith("_mm")}))


def no_contact(word):
    return distances(lambda cell, _: cell or word)


def summed(folder):
    total = np.zeros(3)

    def change(_, row):
        total[:] += [float(row[name]) for name in ("odo_x_m", "odo_y_m", "odo_theta_rad")]
        row.update(zip(("odo_x_m", "odo_y_m", "odo_theta_rad"), map(repr, total.tolist()), strict=True))

    cells(change)(folder)


def in_the_maps_frame(row):
    x, y, heading = (float(row[name]) for name in ("odo_x_m", "odo_y_m", "true_theta_rad"))
    c, s = math.cos(heading), math.sin(heading)
    return {"odo_x_m": repr(c * x - s * y), "odo_y_m": repr(s * x + c * y)}


def obstacle(low, high):
    return whole("arena.toml", lambda data: data + f"\n[[obstacle]]\nmin_m = {low}\nmax_m = {high}\n".encode())


def prior(mean="[1.904608, 0.257048, -1.95387]", sigma="[0.02, 0.02, 0.03]"):
    return whole("prior.toml", lambda _: f'kind = "gaussian"\nmean = {mean}\nsigma = {sigma}\n'.encode())


def radius(value):
    return text("robot.toml", "body_radius_m = 0.165", f"body_radius_m = {value}")


def probabilities(_, row):
    row.update({name: f"{np.exp(float(row[name])):.6f}" for name in row if name.startswith("floor")})


ORDER = r"'t_s' is no number, or no later than before"
OF_SCENES = {
    "plain": (lambda folder: None, RIGHT),
    # time
    "all_zero_t": (stamps(lambda t, n: 0.0), f"{ORDER}, in 299 of 300"),
    "dup_pairs": (stamps(lambda t, n: 0.1 * (n + 2 - n % 2)), f"{ORDER}, in 150 of 300"),
    "clock of whole seconds": (stamps(lambda t, n: float(int(t))), f"{ORDER}, in 269 of 300"),
    "half without stamp": (cells(lambda n, row: row.update(t_s="" if n % 2 else row["t_s"])), f"{ORDER}, in 150"),
    "back10s": (stamps(lambda t, n: t - (10.0 if n >= 150 else 0.0)), f"{ORDER}, in 1[0-9]* of 300"),
    "fwd1h": (stamps(lambda t, n: t + (3600.0 if n >= 150 else 0.0)), "'t_s' leaps by 3600.1 s to row 151"),
    "first_sim_then_epoch": (stamps(lambda t, n: t + (1.7e9 if n else 0.0)), "'t_s' leaps by 1.7e.09 s to row 2"),
    "first_stale": (stamps(lambda t, n: t if n else -5.0), "'t_s' leaps by 5.2 s to row 2"),
    "each fourth lost": (lines(lambda n, line: b"" if n % 4 == 3 else line), "rows are missing"),
    "epoch_s": (stamps(lambda t, n: 1.7e9 + t), RIGHT),
    "epoch_ns": (stamps(lambda t, n: 1.7e18 + 1e9 * t), r"rows are 1e.08 s apart \(are these ns"),
    "epoch_us": (stamps(lambda t, n: 1.7e15 + 1e6 * t), r"rows are 1e.05 s apart \(are these us"),
    "ms": (stamps(lambda t, n: 1e3 * t), r"rows are 100 s apart \(are these ms"),
    # motion
    "absolute_odometry": (summed, r"'odo_x_m': .* more than the base can.*sums since the start"),
    "centimetres": (factor("odo_[xy]_m", 100.0), r"'odo_x_m': .* more than the base can.*\(are these cm or mm"),
    "millimetres": (factor("odo_[xy]_m", 1000.0), r"'odo_x_m': .* more than the base can.*\(are these mm"),
    "degrees": (factor("odo_theta_rad", 57.29578), r"'odo_theta_rad': .* \(are these degrees"),
    "feet": (factor("odo_x_m", 1 / 0.3048), "contacts fit the map [0-9]* .*: the values of 'odo_x_m' look like feet: 1 = 0.3048 m; convert"),
    "turns": (factor("odo_theta_rad", 1 / math.tau), ": the values of 'odo_theta_rad' look like turns: 1 = 6.28319 rad; convert"),
    "turns_to_the_right": (factor("odo_theta_rad", -1.0), ": the values of 'odo_theta_rad' count turns to the right; convert"),
    "backwards": (factor("odo_x_m", -1.0), ": the values of 'odo_x_m' count backwards; convert"),
    "odo_of_words": (cells(lambda n, row: row.update(odo_theta_rad="left")), "'odo_theta_rad': 100% of the rows are no number"),
    "odo_of_zeros": (factor("odo_.*", 0.0), "'object1_mm' changes, and the odometry is 0 in every row"),
    "odo_x_and_y_exchanged": (cells(lambda n, row: row.update(odo_x_m=row["odo_y_m"], odo_y_m=row["odo_x_m"])), r"'odo_y_m' sums to .* sideways, .*\(are x and y exchanged"),
    "odo_in_the_maps_frame": (cells(lambda n, row: row.update(in_the_maps_frame(row))), r"'odo_y_m' sums to .* or in the map's frame"),
    "odo_frozen": (cells(lambda n, row: row.update(odo_x_m="0.013", odo_y_m="0", odo_theta_rad="0.02")), "'odo_x_m' is 0.013 in all of 300 rows"),
    "never_turns": (factor("odo_theta_rad", 0.0), "'odo_theta_rad' is 0 in all of"),
    "odo_garbage": (motion(x_m="1.0001644e+256", y_m="4.687e-54"), r"row 151 moves by 1e\+256"),
    "odo_nan_one": (motion(x_m="nan", y_m="nan", theta_rad="nan"), "row 151 moves by nan"),
    "odo_reset_jump": (motion(x_m="-1.7", y_m="0.4", theta_rad="0.9"), "row 151 moves by -1.7, 0.4, 0.9.* 1 left out"),
    # distances
    "inf_for_no_contact": (no_contact("inf"), RIGHT),
    "Infinity": (no_contact("+Infinity"), RIGHT),
    "max_for_no_contact": (no_contact("140"), "'object1_mm' is 140 in .* empty where nothing is touched"),
    "zero_for_no_contact": (no_contact("0"), "'object1_mm' is 0 in .* empty where nothing is touched"),
    "some_zero": (distances(lambda cell, n: cell or ("" if n % 8 else "0")), "'object1_mm' is 0 in"),
    "minus1_for_no_contact": (no_contact("-1"), "'object1_mm': 239 of 300 cells cannot be .*-1; .*likewise object2_mm"),
    "9999_for_no_contact": (no_contact("9999"), "'object1_mm': 239 of 300 cells cannot be .*9999"),
    "words": (no_contact("none"), "'object1_mm': 239 of 300 cells cannot be .* e.g. no finite number"),
    "metres_not_mm": (factor("object._mm", 0.001), r"'object1_mm' is at most 0.136 .*\(are these cm or m\?"),
    "twins": (cells(lambda n, row: row.update(object2_mm=row["object1_mm"])), "'object2_mm' is that of object1 in every row"),
    "tenths_of_mm": (factor("object._mm", 10.0), r"'object1_mm': .*\(are these 0.1 mm"),
    "micrometres": (factor("object._mm", 1000.0), r"'object1_mm': .*\(are these um"),
    "saturated": (distances(lambda cell, _: cell and repr(max(float(cell), 80.0))), "'object1_mm' is 80 in"),
    "stuck": (distances(lambda cell, _: "88"), "'object1_mm' is 88 in .* look at the sensor"),
    # windows
    "prob_not_log": (cells(probabilities), "'floor1_TEXTURE' sum to 1 .are these probabilities"),
    "percent": (cells(lambda n, row: row.update({k: str(100 * np.exp(float(v))) for k, v in row.items() if k[:5] == "floor" and v})), "'floor1_TEXTURE' sum to 100 .are these probabilities"),
    "one_window": (cells(lambda n, row: row.update(floor1_VINYL="-9", floor1_SMOOTH="-8", floor1_ROUGH="-1")), "'floor1_.* the same in all of 300"),
    "windows_of_nan": (cells(lambda n, row: row.update(floor1_VINYL="nan")), "'floor1_TEXTURE': 300 of 300 cells"),
    "nothing_read": (cells(lambda n, row: row.update({c: "" if c[0] == "f" else "nan" for c in row if c[:5] in ("floor", "objec")})), "no row has a reading"),
    # the text of rows
    "bom": (whole(ROW, lambda data: BOM + data), RIGHT),
    "caps": (whole(ROW, lambda data: data.replace(data.splitlines()[0], data.splitlines()[0].upper())), RIGHT),
    "comment_first": (whole(ROW, lambda data: b"# recorded by me\n" + data), RIGHT),
    "hash_header": (whole(ROW, lambda data: b"# " + data), RIGHT),
    "cr": (whole(ROW, lambda data: data.replace(b"\n", b"\r")), RIGHT),
    "crlf": (whole(ROW, lambda data: data.replace(b"\n", b"\r\n")), RIGHT),
    "empty_lines": (whole(ROW, lambda data: data.replace(b"\n", b"\n\n")), RIGHT),
    "index_col": (lines(lambda n, line: (b"%d," % (n - 1) if n else b",") + line), RIGHT),
    "spaces": (whole(ROW, lambda data: data.replace(b",", b", ")), RIGHT),
    "trailing_comma": (lines(lambda _, line: line + b","), RIGHT),
    "quoted": (lines(lambda _, line: b'"' + line.replace(b",", b'","') + b'"'), RIGHT),
    "header_only": (whole(ROW, lambda data: data.splitlines()[0] + b"\n"), "! no rows; record some"),
    "empty": (whole(ROW, lambda data: b""), "! line 1: no header line; name"),
    "no_header": (whole(ROW, lambda data: data.partition(b"\n")[2]), "! line 1: no header line; name"),
    "only_comments": (whole(ROW, lambda data: b"# nothing\n# yet\n"), "! line 1: no header line; name"),
    "dup_col": (lines(lambda _, line: line + b"," + line.split(b",")[4]), "! line 1: column 'floor1_VINYL' appears twice; keep"),
    "semicolon": (whole(ROW, lambda data: data.replace(b",", b";")), "! line 1: cells are separated by ';'; separate"),
    "semicolon_comma": (whole(ROW, lambda data: data.replace(b",", b";").replace(b".", b",")), "! separated by ';'; separate .*, with decimal points"),
    "tab": (whole(ROW, lambda data: data.replace(b",", b"\t")), r"! line 1: cells are separated by '\\t'; separate"),
    "ragged": (whole(ROW, lambda data: data + b"30.1,0.02\n"), "! line 302: 2 cells but 17 columns; give"),
    "ragged_after_blank": (whole(ROW, lambda data: b"\n" + data + b"30.1,0.02\n"), "! line 303: 2 cells but 17 columns; give"),
    "no_newline_cut": (whole(ROW, lambda data: data[:-40]), "! line 301: .* cells but 17 columns; give"),
    "utf16": (whole(ROW, lambda data: data.decode().encode("utf-16")), "! observations.csv: not a text file; give"),
    # arena
    "arena_full": (obstacle([0.0, 0.0], [2.5, 2.5]), "! arena.toml: no place is free .* body_radius_m 0.165 in 2.5 x 2.5 m; "),
    "radius_of_mm": (radius(165), "! arena.toml: no place is free for a body with body_radius_m 165 "),
    "arena_inverted": (obstacle([1.0, 1.0], [0.5, 1.5]), "! arena.toml, line 51: 'max_m' must be larger"),
    "arena_zero_box": (obstacle([1.0, 1.0], [1.0, 1.5]), "! arena.toml, line 51: 'max_m' must be larger"),
    "arena_out": (obstacle([2.0, 2.0], [3.5, 3.5]), "! arena.toml, line 5.: 'max_m' is outside the arena; move"),
    "arena_overlap_obst": (obstacle([1.5, 1.0], [2.2, 1.7]), OTHER_WORLD),
    "arena_lower": (text("arena.toml", "VRSVV", "vrsvv"), RIGHT),
    "arena_same_letter": (text("arena.toml", "SMOOTH", "VELVET"), "! two names that begin with 'V'; rename"),
    "arena_size_mismatch": (text("arena.toml", "    2.5,\n    2.5,\n", "    2.5,\n    3.0,\n", ), "! 'floor' has 5 rows; size_m and"),
    "origin_deg": (whole("arena.toml", lambda data: b"origin = [0, 0, 90]\n" + data), "! 'origin' must have a heading in rad"),
    # prior
    "prior_crlf_bom": (whole("prior.toml", lambda data: BOM + data.replace(b"\n", b"\r\n")), RIGHT),
    "prior_deg": (prior("[1.904608, 0.257048, 248.05]"), "! prior.toml, line 2: 'mean' .*heading in rad from -10 to 10, not 248.05"),
    "prior_int": (prior("[2, 0, -2]", "[1, 1, 1]"), "contacts fit the map .*: look at"),  # too wide for this filter
    "prior_wide": (prior(sigma="[100.0, 100.0, 100.0]"), OTHER_WORLD),
    "prior_nan": (prior("[nan, 0.2, 0.0]"), "! prior.toml, line 2: 'mean' must be numbers .*not nan"),
    "prior_neg": (prior(sigma="[-0.02, 0.02, 0.03]"), "! prior.toml, line 3: 'sigma' must be numbers"),
    "prior_sigma0": (prior(sigma="[0.0, 0.0, 0.0]"), "! prior.toml, line 3: 'sigma' must be numbers"),
    "prior_outside": (prior("[-3.0, 12.0, 0.0]"), r"! prior.toml: 'mean' \(-3, 12\) is outside the arena, which is within \(0, 0\) and \(2.5, 2.5\); give"),
    "prior_just_outside": (prior("[2.52, 0.25, 0.0]"), r"mean \(2.52, 0.25\) is outside the arena, which is within .*; the belief is clipped"),
    "prior_solid": (prior("[1.75, 1.25, 0]"), r"mean \(1.75, 1.25\) is in an obstacle; the belief is clipped"),
    # robot
    "toml_mm_lengths": (text("robot.toml", "length_m = 0.14", "length_m = 140"), "whisker 'object1' ends 140.139 m from .* 2.5 x 2.5 m; give"),
    "toml_mm_places": (text("robot.toml", "    0.13,\n    0.05,", "    130,\n    50,"), "whisker 'object1' ends 139.* m from"),
    "toml_degrees_yaw": (text("robot.toml", "yaw_rad = 0.7", "yaw_rad = 40"), "! 'yaw_rad' must be a number from -10 to 10, not 40"),
    "toml_nan": (text("robot.toml", "yaw_rad = 0.2", "yaw_rad = nan"), "! 'yaw_rad' must be .*, not nan"),
    "toml_bool": (radius("true"), "! line 1: 'body_radius_m' must be a number .*not True"),
    "toml_str": (radius('"0.165"'), "! line 1: 'body_radius_m' must be a number .*not '0.165'"),
    "toml_date": (radius("2024-01-01"), "! line 1: 'body_radius_m' must be a number"),
    "toml_decimal_comma": (radius("0,165"), "! robot.toml: not TOML .*line 1"),
    "toml_dupkey": (radius("0.165\nbody_radius_m = 0.2"), "! robot.toml: not TOML .*line 2"),
    "toml_latin1": (text("robot.toml", "floor1", b"fl\xf6or1"), "! robot.toml: not a text file; "),
    "toml_utf16": (whole("robot.toml", lambda data: data.decode().encode("utf-16")), "! robot.toml: not a text file; "),
    "toml_single_whisker_table": (text("robot.toml", "[[whisker]]", "[whisker]"), "! robot.toml: not TOML .*line 13"),
    "toml_inline": (whole("robot.toml", lambda data: inline(data)), RIGHT),
}  # fmt: skip


def inline(data):
    """Tables of whiskers as one list."""
    head, *tables = data.decode().split("[[whisker]]\n")
    items = [",".join(re.sub(r"\s+", "", part) for part in re.split(r"\n(?=\w)", table.strip())) for table in tables]
    return f"{head}whisker = [{', '.join('{' + item + '}' for item in items)}]\n".encode()


def answered(capsys, *arguments):
    code, out, err = run(capsys, "localise", *arguments, "--filter", "ekf", "--json")
    return (
        code,
        json.loads(out)["pose_error_median_m"] if code == 0 else out,
        err.splitlines(),
    )


def judge(expected, plain_m, code, found, err):
    """Whether a case got what it must get."""
    if expected.startswith("! "):
        assert code == 2 and found == "" and len(err) == 1 and re.search(expected[2:], err[0]), err
        assert ";" in err[0] or "must" in err[0]
        return
    assert code == 0, err
    if expected in (RIGHT, OTHER_WORLD):
        assert not err and (expected or found == pytest.approx(plain_m, abs=1e-9)), (err, found)
    else:
        assert any(re.search(expected, line) for line in err) and all(";" in line or ":" in line for line in err), err


@pytest.fixture(autouse=True)
def without_regions(monkeypatch):
    monkeypatch.setattr("crunchbot.nav.localise.REGION_ROWS", 0)


@pytest.fixture(scope="module")
def plain_m():
    return median_m("plain", load(CASES / "plain"))


def median_m(folder, scene):
    rows = read_observations(observations_path(CASES / folder), scene)
    table, _ = Filter("ekf", scene).replay(rows, 0, len(rows))
    return float(np.median(np.hypot(*(table["pose"] - rows.truth)[:, :2].T)))


@pytest.mark.parametrize("name", OF_SCENES)
def test_a_scene_gets_what_it_must(capsys, tmp_path, plain_m, name):
    edit, expected = OF_SCENES[name]
    folder = shutil.copytree(CASES / "plain", tmp_path / "s")
    edit(folder)
    code, found, err = answered(capsys, folder)
    judge(expected, plain_m, code, found, err)
    if name in ("dup_pairs", "back10s", "fwd1h", "first_stale", "first_sim_then_epoch", "odo_garbage", "odo_nan_one"):
        assert found < NEAR_M
    if name in ("all_zero_t", "clock of whole seconds"):
        assert found < 0.03  # as wheels alone have it: motion is kept, whatever else is lost


ROOM = np.asarray(Image.open(CASES / "room" / "room.pgm"))  # 0 and 254
WALL = ROOM == 0


def yaml(*pairs, name="ok.yaml"):
    return text(name, *pairs)


def image(levels, name="room.png", **more):
    """An edit that puts an image in the map's: levels, or what Pillow makes of them."""

    def edit(folder):
        made = levels if isinstance(levels, Image.Image) else Image.fromarray(levels)
        made.save(folder / name, **more)
        text("ok.yaml", "room.pgm", name)(folder)

    return edit


def raw_image(header, data):
    return whole("room.pgm", lambda _: header + data)


def both(*edits):
    return lambda folder: [edit(folder) for edit in edits]


def grey(wall, floor):
    return np.where(WALL, wall, floor).astype(np.uint8)


def thick():
    """Walls and boxes a pixel wider each way, as a blurred image has them."""
    near = Image.fromarray(ROOM).filter(ImageFilter.MinFilter(3))
    return np.asarray(near)


def ink():
    bands = np.zeros((*WALL.shape, 4), np.uint8)
    bands[WALL, 3] = 255
    return bands


def two_levels():
    coloured = Image.fromarray(WALL.astype(np.uint8), "P")
    coloured.putpalette([254, 254, 254, 0, 0, 0])
    return coloured


def shifted(folder):
    """Rows and prior in the frame of a map whose corner is at (-10, -3)."""

    def change(_, row):
        row.update(true_x_m=repr(float(row["true_x_m"]) - 10.0), true_y_m=repr(float(row["true_y_m"]) - 3.0))

    cells(change)(folder)
    text("prior.toml", "[1.2, 1.0, 0.3]", "[-8.8, -2.0, 0.3]")(folder)
    yaml("[0.0, 0.0, 0.0]", "[-10.0, -3.0, 0.0]")(folder)


def turned(folder):
    """The same, turned by 1 rad about that corner."""

    def place(x, y):
        return -10.0 + x * math.cos(1.0) - y * math.sin(1.0), -3.0 + x * math.sin(1.0) + y * math.cos(1.0)

    def change(_, row):
        x, y = place(float(row["true_x_m"]), float(row["true_y_m"]))
        row.update(true_x_m=repr(x), true_y_m=repr(y), true_theta_rad=repr(float(row["true_theta_rad"]) + 1.0))

    cells(change)(folder)
    x, y = place(1.2, 1.0)
    text("prior.toml", "[1.2, 1.0, 0.3]", f"[{x}, {y}, 1.3]")(folder)
    yaml("[0.0, 0.0, 0.0]", "[-10.0, -3.0, 1.0]")(folder)


RAW = yaml("free_thresh: 0.196", "free_thresh: 0.196\nmode: raw")
ENDS = ("occupied_thresh: 0.65", "occupied_thresh: 1.0", "free_thresh: 0.196", "free_thresh: 0.0")
ORIGIN = "origin: [0.0, 0.0, 0.0]"
NOT_FREE = "no cell is free: 0% free, .*; mend these fields, or the image"
OF_MAPS = {
    "ok": (lambda folder: None, RIGHT),
    "ascii": (raw_image(b"P2\n60 40\n255\n", b" ".join(b"%d" % v for v in ROOM.ravel())), RIGHT),
    "bom": (whole("ok.yaml", lambda data: BOM + data), RIGHT),
    "crlf": (whole("ok.yaml", lambda data: data.replace(b"\n", b"\r\n")), RIGHT),
    "crlfimg": (raw_image(b"P5\r\n60 40\r\n255\r\n", ROOM.tobytes()), RIGHT),
    "a_byte_more": (raw_image(b"P5\n60 40\n255\n", ROOM.tobytes() + b"\n"), "! 'image': .* 1 bytes more than .*; save it"),
    "a_line_less": (raw_image(b"P5\n60 40\n255\n", ROOM.tobytes()[:-60]), "! 'image': .* 60 bytes less than .*; save it"),
    "w16_short": (raw_image(b"P5\n60 40\n65535\n", ROOM.tobytes()), "! 'image': .* 2400 bytes less than .*; save it"),
    "two_images": (raw_image(b"P6\n60 40\n255\n", 2 * np.repeat(ROOM, 3).tobytes()), "! 'image': .* 7200 bytes more"),
    "colours": (raw_image(b"P6\n60 40\n255\n", np.repeat(ROOM, 3).tobytes()), RIGHT),
    "comment": (raw_image(b"P5\n# made by a map saver\n60 40\n255\n", ROOM.tobytes()), RIGHT),
    "max100": (raw_image(b"P5\n60 40\n100\n", grey(0, 100).tobytes()), RIGHT),
    "w12": (raw_image(b"P5\n60 40\n4095\n", np.where(WALL, 0, 4080).astype(">u2").tobytes()), RIGHT),
    "w16": (raw_image(b"P5\n60 40\n65535\n", np.where(WALL, 0, 65278).astype(">u2").tobytes()), RIGHT),
    "w16png": (image(np.where(WALL, 0, 65278).astype(np.uint16)), RIGHT),
    "one": (image(Image.fromarray(~WALL)), RIGHT),
    "pal": (image(two_levels()), RIGHT),
    "jpg": (image(ROOM, "room.jpg"), "! 'image': .*room.jpg: cannot be read .no whole PNG, PGM or BMP image.; "),
    "tif": (image(ROOM, "room.tif"), "! 'image': .*room.tif: cannot be read"),
    "extra": (whole("ok.yaml", lambda data: data + b"map_type: occupancy\n"), RIGHT),
    "grey_free196": (image(grey(0, 254) - np.where(np.indices(WALL.shape)[1] > 55, 49, 0).astype(np.uint8) * ~WALL), OTHER_WORLD),
    "ink_tri": (image(ink()), f"! {NOT_FREE}"),
    "ink_scale": (both(image(ink()), yaml("free_thresh: 0.196", "free_thresh: 0.196\nmode: scale")), f"! {NOT_FREE}"),
    "black": (image(grey(0, 0)), f"! {NOT_FREE}"),
    "white": (image(grey(254, 254)), "! no cell is solid: 100% free, .*; mend these fields, or the image"),
    "list": (whole("ok.yaml", lambda data: b"- image: room.pgm\n"), "! no object with fields; "),
    "rosmsg": (whole("ok.yaml", lambda data: b"map:\n  image: room.pgm\n"), "! 'resolution' is missing; "),
    "missing": (yaml("room.pgm", "nosuch.pgm"), "! 'image': .*nosuch.pgm: cannot be read .No such file"),
    "tilde": (yaml("room.pgm", "~/map.pgm"), "! 'image': .*map.pgm: cannot be read .No such file"),
    "modecap": (whole("ok.yaml", lambda data: data + b"mode: Trinary\n"), RIGHT),
    "mode_none": (whole("ok.yaml", lambda data: data + b"mode: gray\n"), "! 'mode' must be 'trinary' or .*not 'gray'; "),
    "nan_origin": (yaml(ORIGIN, "origin: [0.0, 0.0, -nan]"), "! 'origin' must be numbers .*, not '-nan' as number 3; "),
    "nan_origin2": (yaml(ORIGIN, "origin: [0.0, .nan, 0.0]"), "! 'origin' must be numbers .*, not nan as number 2; "),
    "yaw_deg": (yaml(ORIGIN, "origin: [0.0, 0.0, 57.3]"), "! 'origin' must have a yaw in rad .*, not 57.3; "),
    "ofs2": (yaml(ORIGIN, "origin: [0.0, 0.0]"), RIGHT),
    "neg": (both(image(255 - ROOM), yaml("negate: 0", "negate: 1")), RIGHT),
    "neg_bool": (both(image(255 - ROOM), yaml("negate: 0", "negate: true")), RIGHT),
    "nofree": (yaml("free_thresh: 0.196\n", ""), "! 'free_thresh' is missing; "),
    "raw": (both(image(grey(100, 0)), RAW), RIGHT),
    "raw_ends": (both(image(grey(100, 0)), RAW, yaml(*ENDS)), RIGHT),
    "raw_unknown": (both(image(np.where(np.indices(WALL.shape)[1] > 55, 255, grey(100, 0)).astype(np.uint8)), RAW), OTHER_WORLD),
    "half_unknown": (both(image(np.where(np.indices(WALL.shape)[1] > 29, 255, grey(100, 0)).astype(np.uint8)), RAW), "% of the rows are on ground that nobody mapped, .*; map it"),
    "raw100": (both(image(grey(255, 0)), RAW), "no cell is solid: 86% free, 0% solid, 14% unknown by mode raw"),
    "res_twice": (whole("ok.yaml", lambda data: data + b"resolution: 0.1\n"), "! 'resolution' appears twice; keep one"),
    "res0": (yaml("0.05", "0.0"), "! 'resolution' must be a number from 0.0001 .*not 0.0; "),
    "resstr": (yaml("0.05", '"0.05"'), "! 'resolution' must be a number .*not '0.05'; "),
    "rescm": (yaml("0.05", "5"), "'resolution' makes a pixel 5 m wide, the robot is 0.21, and the map 300 x 200 m; give"),
    "resmm": (yaml("0.05", "0.0005"), "! no place is free for a body with body_radius_m 0.105 in 0.03 x 0.02 m; "),
    "scale01": (yaml(*ENDS, "negate: 0", "negate: 0\nmode: scale"), RIGHT),
    "scale01bw": (both(image(grey(0, 255)), yaml(*ENDS, "negate: 0", "negate: 0\nmode: Scale")), RIGHT),
    "tri01bw": (both(image(grey(0, 255)), yaml(*ENDS)), f"! {NOT_FREE}"),
    "tab": (yaml("resolution: ", "resolution:\t"), "! not YAML .line 2"),
    "th_pct": (yaml("0.196", "19.6", "0.65", "65"), "! 'free_thresh' must be a number from 0 to 1, not 19.6"),
    "th_swap": (yaml("0.196", "0.9"), "! 'free_thresh' is above occupied_thresh"),
    "shift": (shifted, RIGHT),
    "yaw1": (turned, RIGHT),
    "shift_prior_of_image": (yaml(ORIGIN, "origin: [-10.0, -3.0, 0.0]"), r"! prior.toml: 'mean' \(1.2, 1\) is outside the arena, which is within \(-10, -3\) and \(-7, -1\); give"),
    "left_for_right": (image(ROOM[:, ::-1]), ": the map looks mirrored; mend it"),
    "upside_down": (image(ROOM[::-1]), ": the map looks mirrored and turned by 180 degrees; mend it"),
    "turned_image": (image(np.rot90(ROOM)), ": the map looks turned by 270 degrees; mend it"),
    "blurred": (image(thick()), "contacts fit the map [0-9]* .*: look at the map"),
    "prior_in_wall": (both(yaml(ORIGIN, "origin: [-10.0, -3.0, 0.0]"), text("prior.toml", "[1.2, 1.0, 0.3]", "[-9.99, -2.0, 0.3]")), r"mean \(-9.99, -2\) is in an obstacle; the belief is clipped"),
}  # fmt: skip


@pytest.fixture(scope="module")
def room_m():
    return median_m("room", load(CASES / "room", CASES / "room" / "ok.yaml"))


@pytest.mark.parametrize("name", OF_MAPS)
def test_a_map_gets_what_it_must(capsys, tmp_path, room_m, name):
    edit, expected = OF_MAPS[name]
    folder = shutil.copytree(CASES / "room", tmp_path / "s")
    edit(folder)
    judge(expected, room_m, *answered(capsys, folder, "--map", folder / "ok.yaml"))


def test_a_map_beside_its_arena_is_refused_in_its_numbers(capsys, tmp_path):
    folder = shutil.copytree(CASES / "room", tmp_path / "s")
    yaml(ORIGIN, "origin: [-10.0, -3.0, 0.0]")(folder)
    beside = "! 'origin' lays the map on x -10 to -7 and y -3 to -1 m, where nothing of the arena is free; give"
    judge(beside, 0.0, *answered(capsys, CASES / "plain", "--map", folder / "ok.yaml"))
    yaml("[-10.0, -3.0, 0.0]", "[-2.98, 0.0, 0.0]")(folder)  # its right wall alone reaches in
    judge(
        "! 'origin' lays the map on x -2.98 to 0.02 .*; give",
        0.0,
        *answered(capsys, CASES / "plain", "--map", folder / "ok.yaml"),
    )


@pytest.mark.parametrize("name", ["feet", "turns"])
def test_a_cause_is_named_where_the_filter_finds_places_that_fit(name):
    """The filter that looks for its place anew is sure now and then, and what it reads there fits."""
    scene = load(CASES / "plain")
    rows = read_observations(observations_path(CASES / "plain"), scene)
    by = {"feet": (1 / 0.3048, 1.0, 1.0), "turns": (1.0, 1.0, 1 / math.tau)}[name]
    for changed in (rows, replace(rows, odometry=rows.odometry * by)):
        table, _ = Filter("adaptive", scene).replay(changed, 0, len(changed))
        found = fit_faults(scene, changed, table)
        assert found == [] if changed is rows else f"look like {name}: 1 = " in found[0], found


def test_rows_that_come_late_are_not_missing():
    scene = load(CASES / "plain")
    rows = read_observations(observations_path(CASES / "plain"), scene)
    order = np.arange(len(rows))
    order[9::10], order[8::10] = order[8::10].copy(), order[9::10].copy()
    late = replace(rows, t_s=rows.t_s[order])
    assert [re.search(ORDER, fault) is not None for fault in row_faults(late, scene.robot)] == [True]


def test_alpha_and_scale_are_read_as_map_servers_do(tmp_path):
    """By nav2_map_server: the alpha is a fourth colour in mode trinary, and a hole in scale; 0 and 100 are the scale's ends."""
    bands = np.array(
        [[[205] * 3 + [255], [205] * 3 + [0], [0, 0, 0, 255], [0, 0, 0, 0], [255] * 3 + [0], [255] * 4]], np.uint8
    )
    Image.fromarray(bands).save(tmp_path / "m.png")
    written = "image: m.png\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.8\nfree_thresh: 0.196\nmode: {}\n"
    columns = {}
    for mode in ("trinary", "scale"):
        (tmp_path / "m.yaml").write_text(written.format(mode))
        read = read_map(tmp_path / "m.yaml")
        kinds = ["."] * 6
        for kind, boxes in (("#", read.solid), ("?", read.unknown)):
            for x0, _, x1, _ in boxes:
                kinds[round(x0) : round(x1)] = kind * round(x1 - x0)
        columns[mode] = "".join(kinds)
    assert columns == {"trinary": ".??#?.", "scale": ".?#??."}


def test_the_count_of_bad_cells_is_the_filters():
    """What is said to be left out is what the filter leaves out."""
    scene = load(CASES / "plain")
    rows = read_observations(observations_path(CASES / "plain"), scene)
    rng = np.random.default_rng(4)
    rows.radial_m[:] = rng.choice([0.0, 0.14, 0.209, 0.211, -0.001, np.inf, -np.inf, np.nan, 9.0], rows.radial_m.shape)
    rows.texture[rng.random(rows.texture.shape[:2]) < 0.3] = np.inf
    rows.odometry[7] = (0.0, 1.2, 4.0)
    made = Filter("odometry", scene)
    made.replay(rows, 0, len(rows))
    found = "\n".join(row_faults(rows, scene.robot))
    bad = (rows.radial_m < 0.0) | ((rows.radial_m > 0.21) & np.isfinite(rows.radial_m))
    window = np.isinf(rows.texture[..., 0])
    assert made.bad_cells == bad.sum() + 3 * window.sum() + 2
    assert f"'object1_mm': {bad[:, 0].sum()} of {(~np.isnan(rows.radial_m[:, 0])).sum()} cells" in found
    assert f"'floor1_TEXTURE': {window[:, 0].sum()} of 300" in found and "row 8 moves by 0, 1.2, 4 " in found


def test_rows_that_come_live_are_judged_as_those_of_a_file():
    scene = load(CASES / "plain")
    rows = read_observations(observations_path(CASES / "plain"), scene)
    names = scene.layout.names[:10]
    live = []
    for n in range(len(rows)):
        cells_ = [*rows.texture[n].ravel(), *np.minimum(1000.0 * rows.radial_m[n], 140.0)]
        row = Row.made(0, rows.t_s[n], rows.odometry[n], names, cells_)
        live.append(observed(row, scene))
    again = joined(live)
    assert np.array_equal(again.texture, rows.texture) and again.t_text == rows.t_text
    watch = RowWatch(scene.robot)
    for one in live:
        watch.take(one)
    assert watch.fault == ""  # half a minute
    for shift in range(1, -(-ROWS // len(rows))):
        for one in live:
            watch.take(replace(one, t_s=one.t_s + 30.0 * shift))
    wanted = row_faults(again, scene.robot)[0].replace("236 of 291", "472 of 582")
    assert watch.fault == f"rows: {wanted}" and "472 of 582" in wanted
