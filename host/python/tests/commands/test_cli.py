"""The command line: what docs/cli.md promises, and one line with exit code 2 for every structural mistake."""

# ruff: noqa: F811 - fixtures are taken by their names

import json
import subprocess

import numpy as np
import pytest
from commandkit import run
from folders import folder, recorded  # noqa: F401 - fixtures
from PIL import Image
from whisks import write_whisks

from crunchbot import cli, scene
from crunchbot.nav import localise


def replace_cell(path, row, column, text):
    lines = path.read_text().splitlines()
    cells = lines[row].split(",")
    cells[lines[0].split(",").index(column)] = text
    lines[row] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("name", localise.filter_names())
def test_localise_writes_a_row_per_row_and_a_summary(capsys, folder, tmp_path, name):
    code, out, _ = run(capsys, "localise", folder, "--filter", name, "--out", tmp_path / "est.csv", "--json")
    assert code == 0
    summary = json.loads(out.splitlines()[-1])
    assert summary["filter"] == name and summary["steps"] == 40 and summary["bad_cells"] == summary["bad_rows"] == 0
    assert {"setup_s", "step_us_mean", "step_us_median", "step_us_p99", "step_us_p999"} <= summary.keys()
    assert {"evaluations_per_step", "peak_states", "peak_bytes"} <= summary.keys()
    assert {"pose_error_median_m", "pose_error_p90_m", "heading_error_median_rad", "coverage_90"} <= summary.keys()
    lines = (tmp_path / "est.csv").read_text().splitlines()
    assert lines[0] == "t_s,x_m,y_m,theta_rad,confidence" and len(lines) == 41
    cells = np.array([line.split(",") for line in lines[1:]], dtype=float)
    assert np.array_equal(cells[:, 0], np.round(np.arange(1, 41) * 0.1, 4))
    assert ((cells[:, 4] >= 0) & (cells[:, 4] <= 1)).all()


def test_files_and_arrays_give_the_same_estimates(folder, recorded):
    made, observations = recorded
    again = localise.read_observations(folder / "observations.csv", scene.load(folder))
    assert np.array_equal(again.radial_m, np.round(observations.radial_m, 6), equal_nan=True)
    assert np.array_equal(np.isnan(again.texture), np.isnan(observations.texture))
    ours, theirs = (localise.run("grid", made, o).estimates[-1] for o in (observations, again))
    assert (ours.x_m, ours.y_m) == pytest.approx((theirs.x_m, theirs.y_m), abs=1e-3)


def test_filters_never_read_the_truth_and_earlier_rows_never_know_later_ones(folder, tmp_path, capsys):
    path = folder / "observations.csv"
    run(capsys, "localise", folder, "--out", tmp_path / "a.csv")
    lines = path.read_text().splitlines()
    keep = [i for i, name in enumerate(lines[0].split(",")) if not name.startswith("true_")]
    path.write_text("\n".join(",".join(line.split(",")[i] for i in reversed(keep)) for line in lines[:21]) + "\n")
    code, out, _ = run(capsys, "localise", folder, "--out", tmp_path / "b.csv", "--json")
    assert code == 0 and "pose_error_median_m" not in json.loads(out)
    assert (tmp_path / "b.csv").read_text().splitlines() == (tmp_path / "a.csv").read_text().splitlines()[:21]


def test_bad_cells_are_counted_and_the_run_goes_on(capsys, folder):
    path = folder / "observations.csv"
    bad = [("odo_x_m", "far"), ("odo_y_m", ""), ("floorL_VINYL", "nan"), ("floorR_ROUGH", "what")]
    bad += [("w0_mm", "-5"), ("w1_mm", "what"), ("w2_mm", "-inf"), ("w3_mm", "9999"), ("t_s", "soon")]
    for row, (column, text) in enumerate(bad, start=3):
        replace_cell(path, row, column, text)
    replace_cell(path, 20, "w0_mm", "nan")  # not read: no mistake
    code, out, _ = run(capsys, "localise", folder, "--json")
    summary = json.loads(out)
    assert code == 0 and summary["bad_cells"] == len(bad) and summary["bad_rows"] == 0 and summary["steps"] == 40


def test_repeated_and_reordered_rows_are_counted_and_answered(capsys, folder, tmp_path):
    path = folder / "observations.csv"
    lines = path.read_text().splitlines()
    lines[10], lines[11] = lines[11], lines[10]
    lines.insert(20, lines[20])
    path.write_text("\n".join(lines) + "\n")
    code, out, _ = run(capsys, "localise", folder, "--json", "--out", tmp_path / "e.csv")
    assert code == 0 and json.loads(out)["bad_rows"] == 2
    assert len((tmp_path / "e.csv").read_text().splitlines()) == 42


def test_rows_without_a_row_are_an_error(capsys, folder):
    path = folder / "observations.csv"
    path.write_text(path.read_text().splitlines()[0] + "\n")
    code, out, err = run(capsys, "localise", folder, "--json")
    assert code == 2 and out == "" and str(path) in err and err.count("\n") == 1


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (lambda lines: lines[:1] + [lines[1] + ",7"] + lines[2:], "line 2: 19 cells but 18 columns"),
        (lambda lines: [lines[0].replace("odo_y_m", "odo_x_m"), *lines[1:]], "line 1: column 'odo_x_m' appears twice"),
        (lambda lines: [lines[0].replace("w2_mm", "w9_mm"), *lines[1:]], "line 1: column 'w2_mm' is missing"),
        (lambda lines: [], "no header line"),
    ],
)
def test_structural_mistakes_are_one_line_and_exit_2(capsys, folder, spoil, complaint):
    path = folder / "observations.csv"
    path.write_text("\n".join(spoil(path.read_text().splitlines())))
    code, out, err = run(capsys, "localise", folder)
    assert code == 2 and out == "" and complaint in err and str(path) in err and err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--filter", "crystal"], "choose one of odometry"),
        (["--set", "grid.cel=1"], "--set grid.cel: no such setting"),
        (["--set", "grid.cell_m=2"], "outside 0 to 1"),
        (["--set", "grid.cell_m"], "not KEY=NUMBER"),
        (["--seed", "x"], "--seed"),
        (["--fast"], "--fast"),
        (["--out", "/nowhere/est.csv"], "cannot be written"),
    ],
)
def test_wrong_arguments_are_one_line_and_exit_2(capsys, folder, arguments, complaint):
    code, _, err = run(capsys, "localise", folder, *arguments)
    assert code == 2 and complaint in err and err.count("\n") == 1


def test_without_json_it_speaks_to_a_person(capsys, folder):
    code, out, _ = run(capsys, "localise", folder)
    found = json.loads(run(capsys, "localise", folder, "--json")[1])
    lines = out.splitlines()
    assert code == 0 and len(lines) <= 5
    assert lines[0].startswith(f"adaptive: {found['steps']} rows, ") and "confidence" in lines[1]
    assert f"{1000 * found['pose_error_median_m']:.0f} mm median" in lines[2]
    assert f"{100 * found['coverage_90']:.1f} %" in lines[3]


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["locate"], "localise"),
        (["localise", "--filtre", "grid"], "--filter"),
        (["localise", "--jsn"], "--json"),
        (["texture", "trian"], "train"),
    ],
)
def test_a_word_that_is_nearly_right_is_named(capsys, words, meant):
    code, _, err = run(capsys, *words)
    assert code == 2 and f"did you mean {meant}?" in err and err.count("\n") == 1


def test_a_scene_without_prior_or_observations_is_one_line(capsys, folder):
    (folder / "observations.csv").unlink()
    assert run(capsys, "localise", folder)[0] == 2
    (folder / "prior.toml").unlink()
    code, _, err = run(capsys, "localise", folder)
    assert code == 2 and "prior.toml: missing" in err and err.count("\n") == 1


def test_settings_reach_the_filter(capsys, folder):
    states = []
    for cell in ("0.05", "0.1"):
        _, out, _ = run(capsys, "localise", folder, "--filter", "grid", "--set", f"grid.cell_m={cell}", "--json")
        states.append(json.loads(out)["peak_states"])
    assert states == [50 * 50 * 53, 25 * 25 * 38]


def test_lists_and_help(capsys):
    code, out, _ = run(capsys, "localise", "--list-filters")
    assert code == 0 and {"odometry", "foveal", "grid"} <= set(out.split())
    assert "grid.cell_m=0 (0 to 1)" in run(capsys, "localise", "--list-settings")[1]
    for words in ([], ["localise"], ["texture"], ["texture", "train"], ["texture", "classify"], ["radial"]):
        code, out, _ = run(capsys, *words, "--help")
        assert code == 0 and "example:\n  whisker " in out
    for words in (["radial", "fit"], ["radial", "predict"]):
        assert "example:\n  whisker radial" in run(capsys, *words, "--help")[1]


def test_texture_learns_and_reports(capsys, tmp_path):
    rng = np.random.default_rng(1)
    for name, spread in (("calm", 10.0), ("rough", 80.0)):
        (tmp_path / "d" / name).mkdir(parents=True)
        rows = [f"{i * 5e-4},{int(x)},{int(y)}" for i, (x, y) in enumerate(rng.normal(30000, spread, (2000, 2)))]
        (tmp_path / "d" / name / "1.csv").write_text("\n".join(["t_s,x,y", *rows]))
    model, recording = tmp_path / "m.json", tmp_path / "d" / "rough" / "1.csv"
    assert run(capsys, "texture", "train", tmp_path / "d", "--out", model)[0] == 0
    code, out, _ = run(capsys, "texture", "classify", model, recording, "--json")
    decisions = [json.loads(line) for line in out.splitlines()]
    assert code == 0 and len(decisions) == 10
    assert set(decisions[0]) == {"t_s", "loglik", "label", "best", "confidence"}
    assert set(decisions[0]["loglik"]) == {"calm", "rough"} and {d["label"] for d in decisions} == {"rough"}
    assert run(capsys, "texture", "classify", model, recording, "--window-ms", "0")[0] == 2
    recording.write_text("t_s,x\n0,1\n")
    code, _, err = run(capsys, "texture", "classify", model, recording)
    assert code == 2 and "1 channels, but the model has 2" in err


def test_radial_learns_and_reports(capsys, tmp_path):
    contacts, model = tmp_path / "c.csv", tmp_path / "m.json"
    radii = np.repeat([90.0, 100.0, 110.0, 120.0, 130.0], 5)
    write_whisks(contacts, (181.0 - radii) * 50, radii)
    assert run(capsys, "radial", "fit", contacts, "--out", model)[0] == 0
    code, out, _ = run(capsys, "radial", "predict", model, contacts, "--json")
    answers = [json.loads(line) for line in out.splitlines()]
    assert code == 0 and [a["radius_mm"] for a in answers] == pytest.approx(radii, abs=0.1)
    assert answers[0]["type"] == "shaft" and answers[-1]["type"] == "tip"
    contacts.write_text("contact,radius_mm,t_s,x,y\n0,90,0,1,2\n")
    code, _, err = run(capsys, "radial", "fit", contacts, "--overwrite", "--out", model)
    assert code == 2 and "no contact has 8 rows with numbers" in err and err.count("\n") == 1


def test_an_occupancy_map_stands_beside_or_in_place_of_an_arena(folder, tmp_path, capsys):
    arena, pixel = scene.load(folder).arena, 0.05
    wide, high = (round(side / pixel) + 2 for side in arena.size_m)  # with walls of one pixel around
    cells = np.zeros((high, wide), np.uint8)
    cells[1:-1, 1:-1] = 254
    for box in arena.obstacles:
        x0, y0, x1, y1 = np.round(np.array(box) / pixel).astype(int) + 1
        cells[high - y1 : high - y0, x0:x1] = 0
    Image.fromarray(cells).save(tmp_path / "map.pgm")
    text = "image: map.pgm\nresolution: 0.05\norigin: [{}]\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    (tmp_path / "map.yaml").write_text(text.format("-0.05, -0.05, 0"))
    with_map = ("--map", tmp_path / "map.yaml")

    def reported(name: str, *options) -> tuple[list[float], np.ndarray]:
        code, out, _ = run(
            capsys,
            "localise",
            folder,
            "--filter",
            name,
            "--json",
            "--overwrite",
            "--out",
            tmp_path / "est.csv",
            *options,
        )
        assert code == 0
        errors = [value for key, value in json.loads(out).items() if "_error_" in key]
        return errors, np.genfromtxt(tmp_path / "est.csv", delimiter=",", skip_header=1)

    grid, odometry = reported("grid"), reported("odometry")
    assert np.array_equal(reported("grid", *with_map)[1], grid[1]), "the same boxes, the same answers"
    assert run(capsys, "scene", "map", folder, tmp_path / "map.yaml", "--out", tmp_path / "mapped")[0] == 0
    mapped, before = scene.load(tmp_path / "mapped"), scene.load(folder, tmp_path / "map.yaml")
    assert mapped.arena == before.arena and (tmp_path / "mapped/observations.csv").exists()
    (folder / "arena.toml").unlink()
    assert run(capsys, "scene", "map", folder, tmp_path / "map.yaml", "--out", tmp_path / "alone")[0] == 0
    alone, before = scene.load(tmp_path / "alone"), scene.load(folder, tmp_path / "map.yaml")
    assert alone.origin == before.origin == (-0.05, -0.05, 0.0) and alone.prior == before.prior
    truth, kept = (
        localise.read_observations(place / "observations.csv", alone).truth for place in (folder, tmp_path / "alone")
    )
    assert np.allclose(kept, truth, atol=1e-6)
    again = reported("odometry", *with_map)  # which asks no map: prior, truth and answers are in the map's frame
    assert np.allclose(again[1][:, 1:4], odometry[1][:, 1:4], atol=2e-6) and again[0] == pytest.approx(odometry[0])


def completed(script: str, *words: str) -> list[str]:
    """What bash offers for the last word."""
    line = " ".join(f"'{word}'" for word in words)
    ask = f"""{script}
COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; _shtab_whisker; printf '%s\\n' "${{COMPREPLY[@]}}" """
    return subprocess.run(["bash", "-c", ask], capture_output=True, text=True, check=True).stdout.split()


def test_shells_get_completion(capsys, tmp_path, monkeypatch):
    scripts = {}
    for shell in cli.SHELLS:
        code, scripts[shell], _ = run(capsys, "--print-completion", shell)
        assert code == 0 and "print-completion" in scripts[shell] and "method" in scripts[shell]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.json").touch()
    script = scripts["bash"]
    assert completed(script, "whisker", "te") == ["texture"]
    assert completed(script, "whisker", "texture", "train", "--m") == ["--method"]
    assert completed(script, "whisker", "texture", "train", "--method", "") == ["naive-bayes", "default"]
    assert completed(script, "whisker", "texture", "train", "--out", "mo") == ["model.json"]
