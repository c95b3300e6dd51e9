"""What other tools read of an exported recording is what was recorded: every row, angles in degrees, bad samples none."""

import csv
import json
import math

import numpy as np
import pyarrow.parquet as parquet
import pynwb
import pytest
from commandkit import live_ring, run, signals_as_before  # noqa: F401
from rings import make_frames
from test_recording import write

from crunchbot.recording import read
from crunchbot.recording.table import Table
from whisker_protocol import CODES, STATUS_CODE_SHIFT

ROWS, GAP = 2500, slice(1000, 1010)
LANES = [0, 1, 3]
NAMES = ["left", "right", "lane3"]


@pytest.fixture(scope="module")
def frames():
    made = make_frames(ROWS + 10)
    made["lane_mask"] = 0b1011
    made["lane"]["status"][500:520, 1] = CODES["absent"] << STATUS_CODE_SHIFT
    return np.delete(made, GAP)


@pytest.fixture(scope="module")
def recording(tmp_path_factory, frames):
    path = tmp_path_factory.mktemp("recording") / "a.mcap"
    write(path, frames, lane_names=["left", "right", "un/even", "un/even"])
    return path


def degrees(frames, lane: int, axis: str) -> np.ndarray:
    counts = frames["lane"][axis][:, lane].astype(float)
    angles = (counts - 32768.0) * 180.0 / 65536.0
    return np.where(frames["lane"]["status"][:, lane] == 0, angles, math.nan)


def exported(capsys, recording, path, *more):
    code, out, err = run(capsys, "export", recording, path, *more)
    lost = "10 frames are lost, where tick jumps: 10 never came, 0 were not read in time"
    assert (code, err) == (
        0,
        f"whisker: warning: {recording}: {lost}\n",
    ) and out == f"{path}: {ROWS} frames, lanes {', '.join(NAMES)}\n"
    return path


def test_a_machine_gets_an_object(capsys, tmp_path, recording):
    code, out, err = run(capsys, "export", recording, tmp_path / "a.csv", "--json")
    assert (code, err) == (0, "")
    said = {"out": str(tmp_path / "a.csv"), "frames": ROWS, "lanes": NAMES}
    assert json.loads(out) == said | {"missing": 10, "overrun": 0, "damage": []}


def test_what_the_recording_lost_is_said(capsys, tmp_path, frames):
    with live_ring(frames) as name:
        assert run(capsys, "record", tmp_path / "a.mcap", "--ring", name, "--frames", len(frames))[0] == 0
    code, _, err = run(capsys, "export", tmp_path / "a.mcap", tmp_path / "a.csv")
    assert code == 0 and err.count("\n") == 1
    assert f"{tmp_path}/a.mcap: 10 frames are lost, where tick jumps: 10 never came, 0 were not read in time" in err


def test_csv(capsys, recording, frames, tmp_path):
    with open(exported(capsys, recording, tmp_path / "a.csv"), newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["sequence"]) for row in rows] == frames["sequence"].tolist()
    assert np.diff([int(row["time_ns"]) for row in rows[:900]]) == pytest.approx(500_000)
    for lane, name in zip(LANES, NAMES, strict=True):
        for axis in ("alpha", "beta"):
            read_back = np.array([float(row[f"{name}_{axis}_deg"] or "nan") for row in rows])
            assert read_back == pytest.approx(degrees(frames, lane, axis), abs=1e-5, nan_ok=True)
    assert [int(row["right_status"]) for row in rows] == frames["lane"]["status"][:, 1].tolist()
    assert rows[505]["right_alpha_deg"] == "" and any(rows[505]["left_alpha_deg"] for _ in rows)


def test_parquet(capsys, recording, frames, tmp_path):
    table = parquet.read_table(exported(capsys, recording, tmp_path / "a.parquet"))
    assert table.schema.metadata[b"clock_hz"] == b"60000000"
    assert table["tick"].to_pylist() == frames["tick"].tolist()
    for lane, name in zip(LANES, NAMES, strict=True):
        angles = table[f"{name}_beta_deg"].to_numpy()
        np.testing.assert_allclose(angles, degrees(frames, lane, "beta"), atol=1e-5)
    assert table["right_beta_deg"].null_count == np.isnan(degrees(frames, 1, "beta")).sum() >= 20


def test_nwb_is_valid_and_whole(capsys, recording, frames, tmp_path):
    path = exported(capsys, recording, tmp_path / "a.nwb")
    assert pynwb.validate(path=str(path)) == []
    with pynwb.NWBHDF5IO(path, "r") as io:
        file = io.read()
        for lane, name in zip(LANES, NAMES, strict=True):
            series = file.acquisition[name]
            assert series.unit == "degrees" and series.timestamps.shape == (ROWS,)
            wanted = np.stack([degrees(frames, lane, axis) for axis in ("alpha", "beta")], axis=1)
            np.testing.assert_allclose(series.data[:], wanted, atol=1e-5)
            assert file.acquisition[f"{name}_status"].data[:].tolist() == frames["lane"]["status"][:, lane].tolist()
        assert file.acquisition["left"].timestamps[0] == 0.0
        assert np.diff(file.acquisition["right"].timestamps[:900]) == pytest.approx(5e-4, abs=1e-8)
        assert list(file.intervals["interruptions"]["what"]) == ["missing: 10 frames"]
        with read(recording) as known:
            first_ns = Table(known).first_ns
        assert file.session_start_time.timestamp() == pytest.approx(first_ns * 1e-9, abs=1e-5)


@pytest.mark.parametrize(
    ("out", "more", "wanted"),
    [
        ("a.txt", (), "not a format; end the name in .csv, .parquet, .nwb"),
        ("a.csv", ("--lanes", "30"), "is no lane; give lanes from 0 to 27"),
        ("nosuch/a.parquet", (), "cannot be written"),
        ("nosuch/a.nwb", (), "cannot be written"),
    ],
)
def test_what_cannot_be_exported_is_one_line(capsys, recording, tmp_path, out, more, wanted):
    code, _, err = run(capsys, "export", recording, tmp_path / out, *more)
    assert code == 2 and err.count("\n") == 1 and wanted in err
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_there_is_left_alone(capsys, recording, tmp_path):
    (tmp_path / "a.csv").write_text("mine")
    code, _, err = run(capsys, "export", recording, tmp_path / "a.csv")
    assert code == 2 and "is there already; give --overwrite" in err and (tmp_path / "a.csv").read_text() == "mine"
    exported(capsys, recording, tmp_path / "a.csv", "--overwrite")


@pytest.mark.parametrize("missing", ["pyarrow", "pynwb"])
def test_without_the_extra_one_line_names_it(capsys, recording, tmp_path, monkeypatch, missing):
    monkeypatch.setitem(__import__("sys").modules, missing, None)
    monkeypatch.delitem(__import__("sys").modules, "crunchbot.recording.nwb", raising=False)
    path = tmp_path / ("a.parquet" if missing == "pyarrow" else "a.nwb")
    code, _, err = run(capsys, "export", recording, path)
    assert code == 2 and err == f"whisker: export: needs the package {missing}; run: pip install 'crunchbot[export]'\n"
    exported(capsys, recording, tmp_path / "a.csv")
