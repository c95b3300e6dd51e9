"""Commands speak to people in a sentence or two before any table, and to machines by --json."""

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from commandkit import run

from crunchbot import data
from crunchbot.bridge import doctor
from crunchbot.commands import doctor as doctor_command
from crunchbot.commands.calibrate import _rest_said
from crunchbot.nav.mapping import spoken
from crunchbot.touch.calibration import Rest

ROOT = Path(__file__).resolve().parents[4]
FINDINGS = [doctor.Finding(doctor.OK, "the cable is in"), doctor.Finding(doctor.WARN, "no rule", "install it")]
FAILED = doctor.Finding(doctor.FAIL, "no frames", "start whiskerd")
SUMMARY = {
    "steps": 600, "size_m": [2.5, 2.51], "faces": 5, "tile_m": 0.5, "tiles": 24, "confidence": 0.981, "parts": 1, "lost_s": [],
    "bad_cells": 0, "bad_rows": 0,
}  # fmt: skip


@pytest.fixture(scope="module")
def examples(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("examples")
    with zipfile.ZipFile(Path(data.__path__[0]) / "examples.zip") as packed:
        packed.extractall(folder)
    return next(folder.rglob("contacts.csv")).parent


@pytest.mark.parametrize(
    ("findings", "code", "said"),
    [
        (FINDINGS[:1], 0, "nothing of what was looked at stands in the way:"),
        (FINDINGS, 0, "nothing of what was looked at stands in the way; 1 of 2 findings are worth a look:"),
        ([*FINDINGS, FAILED], 1, "1 of what was looked at stands in the way; 1 of 3 findings are worth a look:"),
    ],
)
def test_doctor_says_first_whether_anything_stands_in_the_way(monkeypatch, capsys, findings, code, said):
    monkeypatch.setattr(doctor_command.doctor, "examine", lambda *_, **__: findings)
    assert run(capsys, "doctor")[:2] == (code, "\n".join([said, *(one.line() for one in findings)]) + "\n")
    ended, out, _ = run(capsys, "doctor", "--json")
    assert ended == code
    assert [json.loads(line)["level"] for line in out.splitlines()] == [one.level for one in findings]


def test_a_map_is_said_in_two_sentences_and_that_its_regions_do_not_hold():
    first, second = spoken(SUMMARY)
    assert first == "600 rows: 5 faces and 24 tiles of 0.50 m in 2.5 m x 2.51 m"
    assert second.startswith("confidence at the end: 0.98; with poor odometry the 90 % regions do not hold: ")
    lost = spoken(SUMMARY | {"parts": 2, "lost_s": [12.04], "bad_cells": 3, "tile_m": None})
    assert "no lattice of tiles" in lost[0] and lost[2].startswith("carried off at 12.0 s: 2 parts")
    assert lost[3] == "not used: 0 rows, 3 cells"


def test_that_a_maps_regions_do_not_hold_is_what_was_measured():
    """As long as this is so, `whisker map` says it; then `regions_hold` goes."""
    families = json.loads((ROOT / "bench/results/map.json").read_text())["families"]
    assert min(families[name]["coverage_90"] for name in ("raw", "noisy")) < 0.8


def test_a_fit_of_contacts_is_one_sentence_and_one_object(capsys, examples, tmp_path):
    words = ["radial", "fit", examples / "contacts.csv", "--model", "linear", "--out"]
    code, out, _ = run(capsys, *words, tmp_path / "a.json")
    assert code == 0 and out.startswith("a place that was left out is found to ")
    code, out, _ = run(capsys, *words, tmp_path / "b.json", "--json")
    found = json.loads(out)
    assert code == 0 and found["contacts"] > 10 and found["place_mm"] == found["tried"]["linear"]["place_mm"]


def test_a_folder_of_surfaces_is_one_sentence_before_its_table(capsys, examples):
    code, out, _ = run(capsys, "texture", "classify", examples / "texture.json", examples / "surfaces")
    sentence, head, *_ = out.splitlines()
    assert code == 0 and " % of " in sentence and " windows right; least " in sentence and head.startswith("surface")


def test_rest_is_one_sentence_before_its_lanes():
    quiet, loud = (
        Rest(0, np.full(2, 100.0), np.array([1.0, 2.0]), 9, 0),
        Rest(1, np.full(2, 100.0), np.array([1.0, 9.0]), 3, 4),
    )
    assert _rest_said([quiet, loud], ["a", "b"]) == "2 lanes at rest; the most noise: b, 9.0 counts; look at b"
    assert _rest_said([], []) == "0 lanes at rest"
