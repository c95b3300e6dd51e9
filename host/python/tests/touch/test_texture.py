"""Texture: equation 1 against NumPy, training, model files, recordings."""

import json

import numpy as np
import pytest

from crunchbot.tables import TableError
from crunchbot.touch.texture.model import TextureModel, channel_names, classify, load, read_recording, read_training

RNG = np.random.default_rng(11)
SPREAD = {"VINYL": 15.0, "SMOOTH": 40.0, "ROUGH": 90.0}


def drag(name, n, rng=RNG):
    return np.round(32768 + rng.normal(0, SPREAD[name], (n, 2)))


@pytest.fixture(scope="module")
def model():
    return TextureModel.train({name: [drag(name, 3000), drag(name, 3000)] for name in SPREAD})


def test_loglik_is_the_sum_of_the_tables_entries(model):
    window = drag("SMOOTH", 200)
    bins = model.table.shape[2]
    place = ((window - model.rest) - model.low) / (model.high - model.low) * bins
    index = np.clip(np.floor(place).astype(int), 0, bins - 1)
    expected = sum(model.table[:, axis, index[:, axis]].sum(axis=1) for axis in range(2))
    assert np.allclose(model.loglik(window), expected, atol=1e-9)


def test_tables_are_probabilities(model):
    assert np.allclose(np.exp(model.table).sum(axis=2), 1.0)


def test_each_surface_is_recognised_and_a_moved_rest_changes_nothing(model):
    for index, name in enumerate(SPREAD):
        window = drag(name, 200)
        assert model.loglik(window).argmax() == index
        assert np.allclose(model.loglik(window + 500, rest=model.rest + 500), model.loglik(window))


def test_saved_models_load_alike(model, tmp_path):
    model.save(tmp_path / "m.json")
    window = drag("ROUGH", 200)
    again = load(tmp_path / "m.json")
    assert again.classes == list(SPREAD)
    assert np.allclose(again.loglik(window), model.loglik(window), atol=1e-3)


def test_samples_that_are_not_finite_are_no_evidence(model):
    assert np.array_equal(model.loglik(np.full((200, 2), np.nan)), np.zeros(3))
    decision = classify(model, np.arange(200) * 5e-4, np.full((200, 2), np.inf))[0]
    assert (decision.label, decision.confidence) == ("unknown", 0.0)


def test_each_window_is_decided_by_itself(model):
    t = np.arange(600) * 5e-4
    samples = np.concatenate([drag("VINYL", 300), drag("ROUGH", 300)])
    assert [d.label for d in classify(model, t, samples)][::2] == ["VINYL", "ROUGH"]


def test_windows_follow_the_recordings_own_rate(model):
    assert len(classify(model, np.arange(100) * 0.01, drag("VINYL", 100), window_ms=100.0)) == 10


@pytest.mark.parametrize(
    "spoil",
    [
        lambda c: c.update(format="something"),
        lambda c: c.pop("low"),
        lambda c: c["loglik"].pop(),
        lambda c: c["loglik"][0][0].pop(),
        lambda c: c.update(low=c["high"]),
        lambda c: c.update(rest=[float("nan"), 0.0]),
        lambda c: c.update(classes=["VINYL"]),
    ],
)
def test_spoiled_model_files_are_one_clear_line(model, tmp_path, spoil):
    path = tmp_path / "m.json"
    model.save(path)
    content = json.loads(path.read_text())
    spoil(content)
    path.write_text(json.dumps(content))
    with pytest.raises(TableError, match="whisker texture train") as error:
        load(path)
    assert str(path) in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "line 1: no header"),
        ("t_s,x,x\n0,1,2\n", "line 1: column 'x' appears twice"),
        ("t_s,x,y\n0,1,2\n1,2\n", "line 3: 2 cells but 3 columns"),
        ("time,x,y\n0,1,2\n", "column 't_s' is missing"),
        ("t_s\n0\n", "no channel column"),
    ],
)
def test_malformed_recordings_are_one_clear_line(tmp_path, text, complaint):
    path = tmp_path / "r.csv"
    path.write_text(text)
    with pytest.raises(TableError, match=complaint):
        read_recording(path)


def test_what_stream_prints_is_a_recording_whose_bad_readings_are_missing(tmp_path):
    path = tmp_path / "r.csv"
    head = "tick,t_s,sequence,lane0_alpha,lane0_beta,lane0_status,lane3_alpha,lane3_beta,lane3_status"
    path.write_text(f"{head}\n7,0.0,2,10,20,0,0,0,6144\n8,0.0005,3,11,21,3,31,41,0\n")
    assert channel_names(path) == ["lane0_alpha", "lane0_beta", "lane3_alpha", "lane3_beta"]
    t_s, samples = read_recording(path)
    assert t_s.tolist() == [0.0, 0.0005]
    np.testing.assert_array_equal(samples, [[10, 20, np.nan, np.nan], [np.nan, np.nan, 31, 41]])


def test_columns_of_such_names_that_no_stream_has_are_channels(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("t_s,tick,x_status\n0,1,2\n1,2,3\n")
    assert read_recording(path)[1].tolist() == [[1, 2], [2, 3]]


def test_bytes_that_are_no_text_are_one_clear_line(tmp_path):
    (tmp_path / "r.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TableError, match="not a text file"):
        read_recording(tmp_path / "r.csv")


def test_a_folder_needs_two_surfaces_with_recordings(tmp_path):
    for name in ("A", "B"):
        (tmp_path / name).mkdir()
    (tmp_path / "A" / "1.csv").write_text("t_s,x\n0,1\n")
    with pytest.raises(TableError, match="folder 'B' holds no CSV"):
        read_training(tmp_path)
    (tmp_path / "B" / "1.csv").write_text("t_s,x,y\n0,1,2\n")
    with pytest.raises(TableError, match="channels"):
        read_training(tmp_path)
