"""The default texture method: training, calibration, faults, borders, other rates and widths, files, command line."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from commandkit import run, signals_as_before  # noqa: F401 - a fixture

from crunchbot.tables import TableError
from crunchbot.touch.texture import model as texture
from crunchbot.touch.texture import spectral
from crunchbot.touch.texture.fit import STRETCHES, log_posterior, temperature
from crunchbot.touch.texture.novelty import _alike, fit_novelty
from crunchbot.touch.texture.spectral import SpectralModel, forward
from crunchbot.touch.texture.train import TEMPERS, _course, _filter_loss, train

RATE_HZ = 2000.0
WINDOW = 200
COLOUR = {"VINYL": 0.0, "SMOOTH": 0.6, "ROUGH": 0.95}  # each sample's share of the one before


def drag(name, n, seed, channels=2, gain=1.0):
    """Coloured noise about a rest of its own: loudness varies more within a surface than between them."""
    rng = np.random.default_rng([seed, sum(map(ord, name))])
    keep = COLOUR[name]
    white = rng.normal(0, np.sqrt(1 - keep**2), (n, channels))
    for i in range(1, n):
        white[i] += keep * white[i - 1]
    loud = gain * rng.uniform(20, 60)
    return np.round(32768 + rng.uniform(-200, 200, channels) + loud * white)


def recordings(names=tuple(COLOUR), count=5, n=2000, channels=2):
    return {name: [drag(name, n, seed, channels) for seed in range(count)] for name in names}


@pytest.fixture(scope="module")
def model():
    return train(recordings(), RATE_HZ)


def share_right(model, window, seeds=range(20, 24), **changes):
    found = [
        (k, d)
        for k, name in enumerate(COLOUR)
        for s in seeds
        for d in model.judge(drag(name, 1600, s, **changes), window)
    ]
    return np.mean([d.label == k for k, d in found])


def test_surfaces_are_reported_apart_on_recordings_never_seen(model):
    assert share_right(model, WINDOW) > 0.95
    assert share_right(model, WINDOW, gain=1.5) > 0.9


def test_an_offset_changes_nothing(model):
    x = drag("SMOOTH", 1000, 31)
    for here, there in zip(model.judge(x, WINDOW), model.judge(x + 2000, WINDOW), strict=True):
        assert here.label == there.label and np.allclose(here.loglik, there.loglik, atol=1e-6)


def test_confidence_is_what_it_says(model):
    found = [(d.best == k, d.confidence) for k, n in enumerate(COLOUR) for s in range(40, 46) for d in model.judge(drag(n, 1000, s), 25)]  # fmt: skip
    right, confidence = np.array(found, float).T
    assert abs(right.mean() - confidence.mean()) < 0.06 and right.mean() < 0.999


def test_what_was_heard_before_counts_and_a_window_alone_does_not(model):
    drives = [(k, model.judge(drag(n, 1000, s), 25)) for k, n in enumerate(COLOUR) for s in range(46, 50)]
    rows = [(k, d) for k, found in drives for d in found]
    alone = np.mean([d.loglik.argmax() == k for k, d in rows])
    assert np.mean([d.best == k for k, d in rows]) > 0.5 * (1.0 + alone) and alone < 0.99


def test_the_filter_is_the_forward_recursion():
    loglik = np.log(np.array([[1.0, 0.5, 0.1], [0.2, 1.0, 0.4]]))
    one = loglik[0] * 0.5 - np.log(np.exp(0.5 * loglik[0]).sum())
    ahead = 0.9 * np.exp(one) + 0.1 * (1.0 - np.exp(one)) / 2.0
    two = ahead * np.exp(0.5 * loglik[1])
    assert np.allclose(forward(loglik, 0.5, 0.1), [np.exp(one), two / two.sum()])


@pytest.mark.parametrize("copies", [1, 8])
def test_windows_that_err_alike_count_less(copies):
    """Each window's evidence is true by itself; copies of it are not."""
    rng = np.random.default_rng(9)
    decisions = []
    for k in np.arange(60) % 2:
        said = np.repeat(rng.normal((-1.0, 1.0)[k], 1.0, 16 // copies), copies)
        decisions.append([SimpleNamespace(loglik=np.array([min(0.0, -2.0 * x), min(0.0, 2.0 * x)])) for x in said])
    course = _course(decisions, np.arange(60) % 2, 16)
    assert len(course[1]) == 960 and (np.diff(course[1]) != 0).sum() == 59
    best = min(TEMPERS, key=lambda temper: _filter_loss(*course, temper, 1 / 16))
    assert best == 1.0 if copies == 1 else best <= 0.5


@pytest.mark.parametrize(("rate_hz", "channels", "window"), [(100.0, 1, 170), (35.0, 16, 64), (2000.0, 3, 200)])
def test_other_rates_and_widths_work(rate_hz, channels, window):
    names = ("VINYL", "ROUGH")
    other = train(recordings(names, count=4, n=800, channels=channels), rate_hz)
    found = [(k, d) for k, n in enumerate(names) for d in other.judge(drag(n, 800, 50, channels), window)]
    assert np.mean([d.label == k for k, d in found]) > 0.9


def hiss(seed, bursts, gain=1.0, n=2000, length=25):
    """White noise of one loudness on average: even, or in bursts shorter than any window asked for."""
    rng = np.random.default_rng([seed, bursts])
    loud = np.repeat(rng.permutation(np.arange(n // length) % 2), length) if bursts else np.full(n, 0.5)
    return np.round(32768 + gain * rng.uniform(40, 80) * np.sqrt(2 * loud + 0.2)[:, None] * rng.normal(size=(n, 1)))


def test_what_comes_in_bursts_is_reported_by_shorter_stretches(tmp_path):
    bursty = train({f"{b}": [hiss(s, b) for s in range(6)] for b in (False, True)}, RATE_HZ)
    assert {r.shorter for r in bursty.classifiers if r.length >= WINDOW} == {STRETCHES}
    right = np.mean(
        [d.loglik.argmax() == b for b in (0, 1) for s in (30, 31, 32) for d in bursty.judge(hiss(s, bool(b)), WINDOW)]
    )
    assert right > 0.95
    bursty.save(tmp_path / "m.json")
    again = texture.load(tmp_path / "m.json")
    x = hiss(40, True)
    for a, b in zip(bursty.judge(x, WINDOW), again.judge(x, WINDOW), strict=True):
        assert a.label == b.label and np.allclose(a.loglik, b.loglik, atol=1e-2)


def test_stretches_that_do_not_pay_are_left_out():
    """Of even noises the whole's power says as much as anything does."""
    even = train({f"{k}": [hiss(s, False, 1.0 + 0.2 * k) for s in range(6 * k, 6 * k + 6)] for k in (0, 1)}, RATE_HZ)
    assert {r.shorter for r in even.classifiers} == {0}


def teeth(seed, falling, n=64):
    """A slow saw beneath noise; back in time it has the same spectrum and the same correlations."""
    rng = np.random.default_rng([seed, falling])
    saw = (np.arange(n) / 16.0 + rng.uniform()) % 1.0
    return np.round(32768 + 400 * (saw[::-1] if falling else saw)[:, None] + rng.normal(0, 20, (n, 1)))


def test_short_recordings_that_bands_do_not_report_apart_are_reported_by_their_shape(tmp_path):
    few = train({f"{f}": [teeth(s, f) for s in range(12)] for f in (False, True)}, 640.0)
    assert len(next(c for c in few.classifiers if c.length == 64).shape) == 3 * 84
    found = [(f, d) for f in (0, 1) for s in range(20, 40) for d in few.judge(teeth(s, bool(f)), 64)]
    assert np.mean([d.best == f for f, d in found]) > 0.9
    few.save(tmp_path / "m.json")
    again = texture.load(tmp_path / "m.json").judge(teeth(20, True), 64)
    assert np.allclose(again[0].loglik, few.judge(teeth(20, True), 64)[0].loglik, rtol=1e-2)


def test_what_few_windows_gain_by_chance_pays_for_nothing():
    """Two names for one surface."""
    none = train({f"{k}": [teeth(s, False) for s in range(10 * k, 10 * k + 10)] for k in (0, 1)}, 640.0)
    of_all = [c for c in none.classifiers if c.length == 64]
    assert [(len(c.shape), c.shorter, c.hidden, c.levels) for c in of_all] == [(0, 0, 0, False)]


def test_a_surface_never_trained_is_unknown(model):
    t = np.arange(1000)[:, None] * np.array([[0.31, 0.17]])
    strange = np.round(32768 + 40 * np.sin(2 * np.pi * t))
    found = model.judge(strange, WINDOW)
    assert [d.label for d in found] == [-1] * 5 and max(d.confidence for d in found) < 0.8


def test_a_border_inside_or_between_windows_is_reported(model):
    for before in (300, 400):
        x = np.concatenate([drag("VINYL", before, 60), drag("ROUGH", 1000 - before, 60)])
        x[before:] += x[before - 1] - x[before]
        found = model.judge(x, WINDOW)
        assert found[1 if before == 300 else 2].border
        assert found[-1].label == 2 and not found[0].border


def test_a_border_is_reported_before_its_window_is_full_and_what_lies_before_it_is_left_out(model):
    x = np.concatenate([drag("VINYL", 1010, 60), drag("ROUGH", 590, 60)])
    x[1010:] += x[1009] - x[1010]
    found = model.judge(x, WINDOW, notices=True)
    reported = next(d for d in found if d.notice)
    assert reported.border and reported.label == -1 and 1010 < reported.end <= 1160 and not reported.loglik.any()
    (cut,) = (d for d in found if d.end == 1200 and not d.notice)
    assert cut.border and cut.label == 2


def test_sequential_decisions_leave_out_what_lies_before_a_border(model):
    x = np.concatenate([drag("VINYL", 1010, 60), drag("ROUGH", 590, 60)])
    x[1010:] += x[1009] - x[1010]
    found = model.judge(x, WINDOW, sequential=True, notices=True)
    border, *_ = (d.end for d in found if d.border)
    assert 1010 < border <= 1160
    assert {d.label for d in found if d.end <= 1010} == {0} and {d.label for d in found if d.end > border} == {2}


def drive(rng, middle):
    """Features (40, 5) of windows in a row: a surface, what the drive adds, and noise."""
    return np.array([middle, 0, 0, 0, 0]) + rng.normal(0, 0.3, 5) + rng.normal(0, 1.5, (40, 5))


@pytest.mark.parametrize(("classes", "drives"), [(3, 3), (2, 5)])
def test_windows_in_a_row_betray_a_surface_that_one_does_not(classes, drives):
    rng = np.random.default_rng(5)
    labels, folds = np.repeat(np.arange(classes), drives), np.tile(np.arange(drives), classes)
    found = fit_novelty([drive(rng, 6.0 * k) for k in labels], labels, folds, WINDOW)
    between = np.array([found.scores(drive(rng, 3.0)) > 0.0 for _ in range(20)])
    known = np.array([found.scores(drive(rng, 6.0 * (n % classes))) > 0.0 for n in range(20)])
    assert between[:, 0].mean() < 0.6 and between[:, 8:].mean() > 0.8 and known[:, 4:].mean() < 0.08


def test_novelty_needs_three_recordings_of_a_class():
    rng = np.random.default_rng(6)
    rows, labels, folds = [drive(rng, 6.0 * (n % 2)) for n in range(6)], np.tile([0, 1], 3), np.repeat([0, 1, 2], 2)
    assert fit_novelty(rows, labels, folds, WINDOW) is not None
    assert fit_novelty(rows[:4], labels[:4], folds[:4], WINDOW) is None
    short = [r if n < 4 else r[:0] for n, r in enumerate(rows)]
    assert fit_novelty(short, labels, folds, WINDOW) is None


def test_recordings_of_one_load_are_left_out_together():
    """What is left out shows how novel a load is that no training drive had."""
    rng = np.random.default_rng(7)
    labels, loads = np.tile(np.arange(3), 15), np.tile(np.repeat(np.arange(5), 3), 3)
    rows = [
        drive(rng, 6.0 * k) + 9.0 * load * np.array([1, 1, 1, -1, 1]) for k, load in zip(labels, loads, strict=True)
    ]
    folds = _alike(rows, labels)
    for k in range(3):
        by_load = [set(folds[(labels == k) & (loads == load)]) for load in range(5)]
        assert sorted(map(len, by_load)) == [1] * 5 and len(set.union(*by_load)) == 5


def test_a_surface_left_out_is_unknown_in_windows_of_any_length_and_sequentially():
    few = train(recordings(("VINYL", "ROUGH"), count=4), RATE_HZ)
    for window, sequential in ((WINDOW, False), (2 * WINDOW, False), (WINDOW, True)):
        refused = {}
        for name in COLOUR:
            late = [
                d for s in (80, 81) for d in few.judge(drag(name, 4000, s), window, sequential) if d.end > 5 * WINDOW
            ]
            refused[name] = np.average([d.label < 0 for d in late], weights=[d.samples for d in late])
        assert refused["SMOOTH"] > 0.6 and max(refused["VINYL"], refused["ROUGH"]) < 0.2


def test_a_catch_is_no_surface_and_by_itself_no_border(model):
    x = drag("SMOOTH", 1000, 61)
    x[450:750, 0] += 3000 * np.sin(np.linspace(0, np.pi, 300))
    assert all(d.label == -1 for d in model.judge(x, WINDOW)[2:4])
    assert not any(d.border for d in model.judge(x, WINDOW))
    x[750:] = drag("VINYL", 1000, 61)[750:]
    assert [d.border for d in model.judge(x, WINDOW)] == [False] * 4 + [True]


def test_how_far_a_window_may_reach_is_what_windows_at_least_as_long_did(model, monkeypatch):
    for classifier in model.classifiers:
        monkeypatch.setattr(classifier, "span", np.full(2, 1.0 if classifier.length == WINDOW else 1e6))
    x = drag("SMOOTH", 1000, 61)
    assert all(d.label == -1 for d in model.judge(x, WINDOW))
    assert not any(d.label == -1 for d in model.judge(x, WINDOW + 1))


@pytest.mark.parametrize("spoil", ["nan", "stuck", "railed", "silent"])
def test_faults_are_unknown_with_no_confidence(model, spoil):
    x = drag("SMOOTH", 600, 62)
    if spoil == "nan":
        x[::3] = np.nan
    elif spoil == "stuck":
        x[:, 0] = x[0, 0]
    elif spoil == "railed":
        x[:, 1] = np.clip((x[:, 1] - 32768) * 1e4, 0, 65535)
    else:
        x[:] = np.inf
    for d in model.judge(x, WINDOW):
        assert d.label == -1 and d.confidence == 0.0 and np.array_equal(d.loglik, np.zeros(3))


def test_one_bad_record_in_a_hundred_is_left_out(model):
    rng = np.random.default_rng(3)
    right = []
    for k, name in enumerate(COLOUR):
        x = drag(name, 2000, 63)
        bad = rng.choice(2000, 20, replace=False)
        x[bad] = rng.uniform(0, 65535, (20, 2))
        found = model.judge(x, WINDOW)
        right += [d.label in (k, -1) for d in found]
        assert sum(d.bad for d in found) >= 15 and all(np.isfinite(d.loglik).all() for d in found)
    assert np.mean(right) > 0.95


def test_sequential_decisions_take_fewer_samples_and_may_not_know(model, monkeypatch):
    found = [
        (k, d) for k, name in enumerate(COLOUR) for d in model.judge(drag(name, 4000, 64), WINDOW, sequential=True)
    ]
    assert np.mean([d.samples for _, d in found]) <= WINDOW / 2
    assert np.mean([d.label == k for k, d in found]) > 0.95
    monkeypatch.setattr(spectral, "SURE", 2.0)
    found = model.judge(drag("SMOOTH", 1600, 65), WINDOW, sequential=True)
    assert [(d.samples, d.label) for d in found] == [(4 * WINDOW, -1)] * 2


def test_block_by_block_is_as_all_at_once(model):
    x = drag("ROUGH", 1000, 66)
    stream = model.stream(WINDOW)
    parts = [d for block in np.array_split(x, 37) for d in stream.push(block)]
    whole = model.judge(x, WINDOW, notices=True)
    assert [(d.end, d.label, d.confidence) for d in parts] == [(d.end, d.label, d.confidence) for d in whole]


def test_saved_models_load_alike_and_are_small(model, tmp_path):
    path = tmp_path / "m.json"
    model.save(path)
    again = texture.load(path)
    x = drag("SMOOTH", 1000, 67)
    assert isinstance(again, SpectralModel) and path.stat().st_size < 200_000
    for a, b in zip(model.judge(x, WINDOW), again.judge(x, WINDOW), strict=True):
        assert a.label == b.label and np.allclose(a.loglik, b.loglik, atol=1e-2)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda c: c.pop("classifiers"),
        lambda c: c.update(classifiers=[]),
        lambda c: c["classifiers"][0]["centre"].pop(),
        lambda c: c["classifiers"][0].update(temper=float("nan")),
        lambda c: c["classifiers"][0].update(length=1 << 30),
        lambda c: c["classifiers"][0].update(hidden=1e9),
        lambda c: c["classifiers"][0].pop("shorter"),
        lambda c: c["novelty"].update(length=201),
        lambda c: c["novelty"]["turn"].pop(),
        lambda c: c["novelty"]["noise"].__setitem__(0, 0.0),
        lambda c: c["classifiers"][-1].update(shorter=8),
        lambda c: c["classifiers"][-1].update(shape=[0.0]),
        lambda c: c["classifiers"][-1].pop("shape"),
        lambda c: c["change"].pop("edge_steady"),
        lambda c: c["classifiers"][-1].update(shorter=-1),
        lambda c: c["classifiers"][-1].update(shorter="eight"),
        lambda c: c.update(format="whisker texture model 8"),
        lambda c: c["classifiers"][0]["weight"][0].pop(),
        lambda c: c.update(classifiers=c["classifiers"][::-1]),
        lambda c: c.pop("columns"),
        lambda c: c.update(columns=["x", "x"]),
        lambda c: c["limits"].pop("spike"),
        lambda c: c["limits"]["still"].pop(),
        lambda c: c.update(classes=["VINYL"]),
        lambda c: c.update(hazard="much"),
    ],
)
def test_spoiled_model_files_are_one_clear_line(model, tmp_path, spoil):
    path = tmp_path / "m.json"
    model.save(path)
    content = json.loads(path.read_text())
    spoil(content)
    path.write_text(json.dumps(content))
    with pytest.raises(TableError, match="whisker texture train") as error:
        texture.load(path)
    assert "\n" not in str(error.value)


def write(path, samples, rate_hz=RATE_HZ):
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = [f"{i / rate_hz:.4f},{','.join(f'{v:g}' for v in s)}\n" for i, s in enumerate(samples)]
    path.write_text("t_s,x,y\n" + "".join(rows))


@pytest.mark.parametrize("method", ["naive-bayes", "default"])
def test_commands_train_and_classify_as_promised(capsys, tmp_path, method):
    for name in ("VINYL", "ROUGH"):
        for n in range(3):
            write(tmp_path / "set" / name / f"{n}.csv", drag(name, 1000, n))
    assert run(capsys, "texture", "train", tmp_path / "set", "--out", tmp_path / "m.json", "--method", method)[0] == 0
    write(tmp_path / "drive.csv", drag("ROUGH", 1000, 9))
    for more in ([], ["--sequential"]):
        code, out, _ = run(capsys, "texture", "classify", tmp_path / "m.json", tmp_path / "drive.csv", "--json", *more)
        lines = [json.loads(line) for line in out.splitlines()]
        assert code == 0 and all(set(d) == {"t_s", "loglik", "label", "best", "confidence", "border"} for d in lines)
        assert set(lines[0]["loglik"]) == {"VINYL", "ROUGH"} and more or len(lines) == 5


def test_training_reports_figures_and_what_it_could_not_learn(capsys, tmp_path, recwarn):
    """One recording of a class, a channel that never changes, rows that are not finite, a hidden folder."""
    for name in ("VINYL", "ROUGH"):
        x = drag(name, 800, 0)
        x[:, 1], x[7] = 500.0, np.nan
        write(tmp_path / "set" / name / "0.csv", x)
    (tmp_path / "set" / ".cache").mkdir()
    code, out, error = run(capsys, "texture", "train", tmp_path / "set", "--out", tmp_path / "m.json")
    assert code == 0 and "2 classes: ROUGH, VINYL" in out and "calibration error" in out and "not learned:" in out
    warned = error.splitlines()
    assert sum("1 of 800 rows" in line for line in warned) == sum("channel 2 never" in line for line in warned) == 2
    assert not recwarn.list


def test_channels_that_are_no_counts_are_learnt_and_have_no_stops(tmp_path):
    """Zero is a value as any other there; of raw counts it is the sensor's stop."""
    units = {name: [(drag(name, 800, s) - 32768) / 100 for s in range(3)] for name in ("VINYL", "ROUGH")}
    units["VINYL"][0][:80, 0] = 0.0
    assert texture.recording_faults(units["VINYL"][0]) == []
    counts = drag("VINYL", 800, 0)
    counts[:80, 0] = 0.0
    assert texture.recording_faults(counts) == ["channel 1 is at its stop in 10 % of its samples"]
    train(units, RATE_HZ, 25.0).save(tmp_path / "m.json")
    found = texture.load(tmp_path / "m.json").judge((drag("ROUGH", 400, 9) - 32768) / 100, 50)
    assert np.mean([d.loglik.argmax() == 1 for d in found]) > 0.7


def test_a_folder_is_classified_at_once(capsys, tmp_path, model):
    model.save(tmp_path / "m.json")
    for name in ("ROUGH", "VINYL", "VELVET"):
        write(tmp_path / "set" / name / "0.csv", drag(name if name in COLOUR else "ROUGH", 1000, 71))
    (tmp_path / "set" / ".hidden").mkdir()
    command = "texture", "classify", tmp_path / "m.json", tmp_path / "set"
    code, out, _ = run(capsys, *command, "--json")
    rows = {row["surface"]: row for row in map(json.loads, out.splitlines())}
    assert code == 0 and {n: r["decisions"] for n, r in rows.items()} == {"ROUGH": 5, "VELVET": 5, "VINYL": 5}
    for name in COLOUR.keys() & rows:
        alone = run(capsys, *command[:3], tmp_path / "set" / name / "0.csv", "--json")[1].splitlines()
        labels = [json.loads(line)["label"] for line in alone]
        assert [rows[name][c] for c in (*COLOUR, "unknown")] == [labels.count(c) for c in (*COLOUR, "unknown")]
    assert rows["ROUGH"]["ROUGH"] >= 3 and rows["VINYL"]["VINYL"] >= 3
    code, out, error = run(capsys, *command)
    assert code == 0 and len(out.splitlines()) == 4 and "folder 'VELVET' is no class" in error


@pytest.mark.parametrize("name", ["vinyl", "VINYL "])
def test_a_surface_spelt_twice_is_one_clear_line(capsys, tmp_path, name):
    for folder in ("VINYL", name):
        write(tmp_path / "set" / folder / "0.csv", drag("VINYL", 100, 0))
    code, _, error = run(capsys, "texture", "train", tmp_path / "set", "--out", tmp_path / "m.json")
    assert code != 0 and "name one surface twice" in error and error.count("\n") == 1


def test_the_temperature_is_the_one_of_least_loss():
    rng = np.random.default_rng(8)
    label = rng.integers(0, 3, 400)
    scores = rng.normal(size=(400, 3)) * 4.0
    scores[np.arange(400), label] += 1.5
    grid = np.linspace(0.0, 1.0, 2001)
    best = grid[np.argmax([log_posterior(scores * t, label).mean() for t in grid])]
    assert 0.05 < best < 0.95 and abs(temperature(scores, label) - best) < 2e-3
    separable = np.where(np.arange(3) == label[:, None], 0.0, -9.0)
    assert temperature(separable, label) > 0.99 and temperature(-separable, label) < 0.01


def test_training_is_for_the_window_asked_for(capsys, tmp_path):
    for name in ("VINYL", "ROUGH"):
        for n in range(3):
            write(tmp_path / "set" / name / f"{n}.csv", drag(name, 1000, n))
    command = ["texture", "train", tmp_path / "set", "--overwrite", "--out", tmp_path / "m.json", "--window-ms"]
    assert run(capsys, *command, "200", "--speed-m-s", "0.3", "--tile-m", "0.5")[0] == 0
    made = texture.load(tmp_path / "m.json")
    assert made.figures["window_samples"] == 400 and made.hazard == pytest.approx(0.12)
    for more, complaint in (
        ([], "give both"),
        (["--speed-m-s", "9"], "3.6 surfaces a window"),
        (["--speed-m-s", "nan"], "give both"),
    ):
        code, _, error = run(capsys, *command, "200", "--tile-m", "0.5", *more)
        assert code != 0 and f"--speed-m-s, --tile-m: {complaint}" in error and error.count("\n") == 1
    code, _, error = run(capsys, *command, "-1")
    assert code != 0 and "--window-ms" in error and error.count("\n") == 1


def test_windows_do_not_reach_across_gaps(model):
    t = np.concatenate([np.arange(300), np.arange(300) + 5000]) / RATE_HZ
    found = texture.classify(model, t, drag("VINYL", 600, 70))
    assert [round(d.t_s * RATE_HZ) for d in found] == [199, 5199]


def test_recordings_of_different_rates_are_one_clear_line(tmp_path):
    write(tmp_path / "A/1.csv", drag("VINYL", 50, 1))
    write(tmp_path / "B/1.csv", drag("ROUGH", 50, 1), rate_hz=100.0)
    with pytest.raises(TableError, match="100 to 2000 Hz; give one rate"):
        texture.read_training(tmp_path)


def test_channels_in_another_order_are_one_clear_line(capsys, tmp_path):
    for name in ("VINYL", "ROUGH"):
        write(tmp_path / "set" / name / "0.csv", drag(name, 400, 0))
    model = tmp_path / "m.json"
    assert run(capsys, "texture", "train", tmp_path / "set", "--out", model)[0] == 0
    swapped = tmp_path / "set" / "VINYL" / "1.csv"
    write(swapped, drag("VINYL", 400, 1))
    assert run(capsys, "texture", "classify", model, swapped)[0] == 0
    swapped.write_text(swapped.read_text().replace("t_s,x,y", "t_s,y,x"))
    for command in (("classify", model, swapped), ("train", tmp_path / "set", "--overwrite", "--out", model)):
        code, _, error = run(capsys, "texture", *command)
        assert code != 0 and "1.csv, line 1: columns y, x; give x, y" in error and error.count("\n") == 1


def edit(path, change):
    """Change each row of a recording: a list of its cells."""
    head, *rows = path.read_text().splitlines()
    path.write_text("\n".join([head, *(",".join(change(n, row.split(","))) for n, row in enumerate(rows))]) + "\n")


def late(n, row):
    return [{3: "soon", 5: "0"}.get(n, row[0]), *row[1:]]


def stuck(n, row):
    return row if n < 100 else [*row[:2], "32768"]


FAULTS = {  # what is done to VINYL/1.csv -> what is said of it by train and by classify; an exit code, or 0 where it goes on
    "three rows": (
        lambda p: p.write_text("t_s,x,y\n0,1,2\n.0005,2,3\n.001,3,4\n"),
        2,
        "3 rows, hardly any",
        "no decision",
    ),
    "no rows": (lambda p: p.write_text("t_s,x,y\n"), 2, "0 rows, hardly any", "no decision"),
    "no numbers": (
        lambda p: edit(p, lambda n, r: [r[0], "", ""]),
        2,
        "800 rows, hardly any",
        "800 of 800 rows are not",
    ),
    "no time": (lambda p: edit(p, lambda n, r: ["0", *r[1:]]), 2, *2 * ("line 1: column 't_s' never increases",)),
    "backwards": (lambda p: edit(p, lambda n, r: [f"{-n}", *r[1:]]), 2, *2 * ("line 1: column 't_s' never increases",)),
    "another rate": (lambda p: edit(p, lambda n, r: [f"{n / 100}", *r[1:]]), 2, "give one rate (", "sampled at 100 Hz"),
    "a channel more": (
        lambda p: p.write_text("t_s,x,y,z\n0,1,2,3\n1,2,3,4\n"),
        2,
        "3 channels; give the 2 of",
        "3 channels, but the model has 2",
    ),
    "some times": (lambda p: edit(p, late), 0, *2 * ("2 of 800 times are no number or not after",)),
    "half stuck": (lambda p: edit(p, stuck), 0, *2 * ("channel 2 keeps one value for 700 of its 800",)),
    "saturated": (
        lambda p: edit(p, lambda n, r: [*r[:2], r[2] if n % 9 else "65535"]),
        0,
        *2 * ("channel 2 is at its stop in 11 %",),
    ),
    "another whisker's": (
        lambda p: p.write_text(p.read_text().replace("x,y", "a,b")),
        0,
        *2 * ("columns a, b taken for x, y",),
    ),
    "shorter than a window": (
        lambda p: p.write_text("\n".join(p.read_text().splitlines()[:101]) + "\n"),
        0,
        "100 samples; no window of the model will be longer",
        "100 samples and no decision",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_faulty_recording_is_named_with_what_is_wrong(capsys, tmp_path, fault):
    spoil, code, of_training, of_answer = FAULTS[fault]
    for name in ("VINYL", "ROUGH"):
        for n in range(2):
            write(tmp_path / "set" / name / f"{n}.csv", drag(name, 800, n))
    model, spoilt = tmp_path / "m.json", tmp_path / "set/VINYL/1.csv"
    command = "texture", "train", tmp_path / "set", "--overwrite", "--out", model
    assert run(capsys, *command)[0] == 0
    spoil(spoilt)
    for words, wanted in ((("classify", model, spoilt), of_answer), (command[1:], of_training)):
        found, _, error = run(capsys, "texture", *words)
        (line,) = (line for line in error.splitlines() if wanted in line)
        assert "VINYL/1.csv" in line and found == (0 if "warning" in line else 2)
    assert found == code


def test_surfaces_that_may_be_misspelt_or_were_recorded_once_are_reported(capsys, tmp_path):
    names = "SMOOTH", "SMOTH", "TILE1", "TILE2", "SMOOHT"
    for name in names:
        write(tmp_path / name / "0.csv", drag("VINYL", 200, 0))
    lines = []
    texture.read_training(tmp_path, lines.append)
    reported = [set(line.split("'")[1::2]) for line in lines if "differ by a letter" in line]
    assert reported == [{"SMOOHT", "SMOOTH"}, {"SMOOTH", "SMOTH"}] and len(lines) == 3
    assert "one recording of SMOOHT, SMOOTH, SMOTH, TILE1, TILE2" in "".join(lines)


def test_one_surface_or_no_folder_is_one_clear_line(capsys, tmp_path):
    write(tmp_path / "set/VINYL/0.csv", drag("VINYL", 200, 0))
    for folder, wanted in (("set", "1 surface folder(s); give at least two"), ("none", "no such folder")):
        code, _, error = run(capsys, "texture", "train", tmp_path / folder, "--out", tmp_path / "m.json")
        assert code == 2 and wanted in error and error.count("\n") == 1


def test_too_little_to_learn_from_is_said():
    with pytest.raises(ValueError, match="record each surface"):
        train({"A": [np.zeros((3, 2))], "B": [np.zeros((3, 2))]}, RATE_HZ)
