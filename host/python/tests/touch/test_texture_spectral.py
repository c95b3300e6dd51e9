"""The default texture method: training, calibration, faults, other rates and widths, files, command line."""

import json

import numpy as np
import pytest
from commandkit import run, signals_as_before  # noqa: F401 - a fixture

from crunchbot.tables import TableError
from crunchbot.touch.texture import model as texture
from crunchbot.touch.texture import spectral
from crunchbot.touch.texture import train as training
from crunchbot.touch.texture.fit import TEMPERATURE, Windows, most_probable, temperature
from crunchbot.touch.texture.novelty import ROW, Rows, conformal, fit_novelty, limits
from crunchbot.touch.texture.spectral import HAZARD, SpectralModel, forward
from crunchbot.touch.texture.train import BEHIND, Learnt, _loss_behind, calibration_error, train

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


@pytest.fixture(scope="module")
def short():
    """For windows that do not tell everything."""
    return train(recordings(), RATE_HZ, 12.5)


def judged(model, window, seeds=range(20, 24), **changes):
    """Class, and decision, of recordings never trained on."""
    drives = [(k, drag(name, 1600, s, **changes)) for k, name in enumerate(COLOUR) for s in seeds]
    return [(k, d) for k, x in drives for d in model.judge(x, window)]


def test_surfaces_are_reported_apart_on_recordings_never_seen(model):
    assert np.mean([d.label == k for k, d in judged(model, WINDOW)]) > 0.95


def test_a_load_beyond_those_of_training_may_be_unknown_but_is_taken_for_no_other_surface(model):
    found = judged(model, WINDOW, gain=1.5)
    assert all(d.best == k for k, d in found) and np.mean([d.label == k for k, d in found]) > 0.85


def test_an_offset_changes_nothing(model):
    x = drag("SMOOTH", 1000, 31)
    for here, there in zip(model.judge(x, WINDOW), model.judge(x + 2000, WINDOW), strict=True):
        assert here.label == there.label and np.allclose(here.loglik, there.loglik, atol=1e-6)


def test_confidence_is_what_it_says(short):
    found = [(d.best == k, d.confidence) for k, n in enumerate(COLOUR) for s in range(40, 46) for d in short.judge(drag(n, 1000, s), 25)]  # fmt: skip
    right, confidence = np.array(found, float).T
    assert abs(right.mean() - confidence.mean()) < 0.06 and right.mean() < 0.999


def test_what_was_heard_before_counts_and_a_window_alone_does_not(short):
    drives = [(k, short.judge(drag(n, 1000, s), 25)) for k, n in enumerate(COLOUR) for s in range(46, 50)]
    rows = [(k, d) for k, found in drives for d in found]
    alone = np.mean([d.loglik.argmax() == k for k, d in rows])
    assert np.mean([d.best == k for k, d in rows]) > 0.5 * (1.0 + alone) and alone < 0.99


def test_the_filter_is_the_forward_recursion_and_the_first_window_counts_whole():
    loglik = np.log(np.array([[1.0, 0.5, 0.1], [0.2, 1.0, 0.4]]))
    one = np.exp(loglik[0]) / np.exp(loglik[0]).sum()
    ahead = 0.9 * one + 0.1 * (1.0 - one) / 2.0
    two = ahead * np.exp(0.5 * loglik[1])
    assert np.allclose(forward(loglik, 0.5, 0.1), [one, two / two.sum()])


@pytest.mark.parametrize("copies", [1, 8])
def test_windows_that_err_alike_count_less(copies):
    """Each window's evidence is true by itself; copies of it are not."""
    rng = np.random.default_rng(9)
    rows = []
    for k in np.arange(60) % 2:
        said = np.repeat(rng.normal((-1.0, 1.0)[k], 1.0, 16 // copies), copies)
        rows.append((np.column_stack([np.minimum(0.0, -2.0 * said), np.minimum(0.0, 2.0 * said)]), k))
    best = most_probable(lambda weight: _loss_behind(rows, weight, 1 / 160), BEHIND, 1.0)
    assert best > 0.5 if copies == 1 else best < 0.2


def test_recordings_of_one_window_say_nothing_of_windows_behind_the_first():
    rows = [(np.array([[0.0, -9.0]]), 1), (np.array([[-9.0, 0.0]]), 0)]
    assert most_probable(lambda weight: _loss_behind(rows, weight, 0.02), BEHIND, 1.0) == pytest.approx(
        BEHIND, rel=1e-3
    )


@pytest.mark.parametrize(("rate_hz", "channels", "window"), [(100.0, 1, 170), (35.0, 16, 64), (2000.0, 3, 200)])
def test_other_rates_and_widths_work(rate_hz, channels, window):
    names = ("VINYL", "ROUGH")
    made = recordings(names, count=4, n=800, channels=channels)
    other = train(made, rate_hz, 1000.0 * window / rate_hz)
    found = [(k, d) for k, n in enumerate(names) for d in other.judge(drag(n, 800, 50, channels), window)]
    assert np.mean([d.label == k for k, d in found]) > 0.9


def hiss(seed, bursts, gain=1.0, n=2000, length=25):
    """White noise of one loudness on average: even, or in bursts shorter than any window asked for."""
    rng = np.random.default_rng([seed, bursts])
    loud = np.repeat(rng.permutation(np.arange(n // length) % 2), length) if bursts else np.full(n, 0.5)
    return np.round(32768 + gain * rng.uniform(40, 80) * np.sqrt(2 * loud + 0.2)[:, None] * rng.normal(size=(n, 1)))


def test_what_comes_in_bursts_is_reported_by_shorter_stretches(tmp_path):
    bursty = train({f"{b}": [hiss(s, b) for s in range(6)] for b in (False, True)}, RATE_HZ)
    right = np.mean(
        [d.loglik.argmax() == b for b in (0, 1) for s in (30, 31, 32) for d in bursty.judge(hiss(s, bool(b)), WINDOW)]
    )
    assert right > 0.95
    bursty.save(tmp_path / "m.json")
    again = texture.load(tmp_path / "m.json")
    x = hiss(40, True)
    for a, b in zip(bursty.judge(x, WINDOW), again.judge(x, WINDOW), strict=True):
        assert a.label == b.label and np.allclose(a.loglik, b.loglik, atol=1e-2)


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


def test_two_names_for_one_surface_are_not_told_apart_with_confidence():
    none = train({f"{k}": [teeth(s, False) for s in range(10 * k, 10 * k + 10)] for k in (0, 1)}, 640.0, 100.0)
    sure = [d.confidence for s in range(30, 60) for d in none.judge(teeth(s, False), 64)]
    assert np.mean(sure) < 0.75


def test_shapes_are_left_out_where_recordings_held_out_clearly_lose_by_them(monkeypatch):
    made = {f"{f}": [teeth(s, f) for s in range(12)] for f in (False, True)}
    assert len(train(made, 640.0).classifiers[-1].shape) > 0
    monkeypatch.setattr(
        training.fit.__globals__["Fitted"], "_right", lambda self, scores: np.full(24, -float(len(self.shape) > 0))
    )
    assert len(train(made, 640.0).classifiers[-1].shape) == 0


def test_a_surface_never_trained_is_unknown(model):
    t = np.arange(1000)[:, None] * np.array([[0.31, 0.17]])
    strange = np.round(32768 + 40 * np.sin(2 * np.pi * t))
    found = model.judge(strange, WINDOW)
    assert [d.label for d in found] == [-1] * 5 and min(d.novelty for d in found) > 1.0


def test_what_is_never_trained_decides_the_label_and_leaves_confidence_alone(model, monkeypatch):
    x = drag("SMOOTH", 1000, 31)
    before = model.judge(x, WINDOW)
    monkeypatch.setattr(model.novelty, "limit", np.full(ROW, 1e-6))
    for free, bound in zip(before, model.judge(x, WINDOW), strict=True):
        assert free.label == 1 and bound.label == -1
        assert free.confidence == bound.confidence and np.array_equal(free.loglik, bound.loglik)


def drive(rng, middle):
    """Features (40, 5) of windows in a row: a surface, what the drive adds, and noise."""
    return np.array([middle, 0, 0, 0, 0]) + rng.normal(0, 0.3, 5) + rng.normal(0, 1.5, (40, 5))


def limited(rows, labels, classes):
    """The distance, with the limit of recordings left out in turn."""
    labels, apart, parts = np.asarray(labels), [], [Rows(r) for r in rows]
    for n, part in enumerate(parts):
        kept = [i for i in range(len(rows)) if i != n]
        twin = fit_novelty([parts[i] for i in kept], labels[kept], classes, WINDOW)
        apart.append([twin.distances(row) for row in part.each])
    found = fit_novelty(parts, labels, classes, WINDOW)
    found.limit = limits(apart, 0.07)
    return found


@pytest.mark.parametrize(("classes", "drives"), [(3, 3), (2, 5)])
def test_windows_in_a_row_betray_a_surface_that_one_does_not(classes, drives):
    labels, between, known = np.repeat(np.arange(classes), drives), [], []
    for draw in range(8):
        rng = np.random.default_rng(draw)
        found = limited([drive(rng, 6.0 * k) for k in labels], labels, classes)
        between += [found.distances(drive(rng, 3.0)) > 1.0 for _ in range(20)]
        known += [found.distances(drive(rng, 6.0 * (n % classes))) > 1.0 for n in range(20)]
    between, known = np.array(between), np.array(known)
    assert between[:, 0].mean() < 0.6 and between[:, 15:].mean() > 0.8 and known[:, 4:].mean() < 0.2


def test_a_limit_is_that_of_rows_as_long_as_the_one_judged():
    """What changes within a drive is as far apart as what changes between drives: a row is refused no more often late in it."""
    rng, labels = np.random.default_rng(7), np.repeat([0, 1], 12)

    def moved(middle):
        return np.concatenate([drive(rng, middle)[:ROW] for _ in range(3)])

    found = limited([moved(6.0 * k) for k in labels], labels, 2)
    known = np.array([found.distances(drive(rng, 0.0)[:ROW]) > 1.0 for _ in range(300)]).mean(axis=0)
    assert known.max() < 0.14 and abs(known[0] - known[-1]) < 0.07


def test_a_limit_is_never_below_that_of_rows_of_all_lengths():
    apart = [[np.array([5.0, 1.0])] for _ in range(20)]
    assert limits(apart, 0.6).tolist() == [5.0] + (ROW - 1) * [1.0]
    assert limits(apart, 0.4).tolist() == ROW * [5.0]


def test_a_place_counts_once_however_often_it_was_passed():
    """Nine of ten passes are over one place: what they say is of one in two places."""
    passes = [np.array([float(n)]) for n in range(10)]
    assert conformal(passes, 0.3) == 7.0 and conformal(passes, 0.3, np.array([0] * 9 + [1])) == 9.0
    assert conformal(passes[:4] * 5, 0.3, np.arange(20) % 4) == 3.0 and conformal(passes[:4] * 5, 0.3) == 2.0
    rows = [[np.full(ROW, value[0])] for value in passes]
    assert limits(rows, 0.3, np.array([0] * 9 + [1])).tolist() == ROW * [9.0] and limits(rows, 0.3)[0] == 7.0


def test_a_pass_of_each_place_is_kept_and_each_recording_where_no_place_is_known():
    made = {name: [hiss(s, False, g, 1200) for s in range(6)] for name, g in (("A", 0.6), ("B", 1.4))}
    places = {"A": ["c0r0", "c1r0", "c0r0", "c2r0", "c1r0", "c3r0"], "B": ["c5r5"] * 6}
    model = train(made, RATE_HZ, 25.0, places=places)
    assert {name: len(some) for name, some in model.passes.items()} == {"A": 4, "B": 1}
    assert model.figures["held_out_units"] == 4 + 6
    assert {name: len(some) for name, some in train(made, RATE_HZ, 25.0).passes.items()} == {"A": 6, "B": 6}


def test_a_distance_needs_two_recordings_of_a_surface_and_one_of_each():
    rng = np.random.default_rng(6)
    spreads = [Rows(drive(rng, 6.0 * (n % 2))) for n in range(4)]
    assert fit_novelty(spreads[:3], np.array([0, 1, 0]), 2, WINDOW) is not None
    assert fit_novelty(spreads[:2], np.array([0, 1]), 2, WINDOW) is None
    assert fit_novelty(spreads[:2], np.array([0, 0]), 2, WINDOW) is None


@pytest.mark.parametrize(("recordings", "level"), [(3, 0.25), (11, 1 / 12), (12, 0.08), (40, 0.08), (99, 0.08)])
def test_what_recordings_held_out_bound_the_next_one_keeps_to_by_the_level(recordings, level):
    """Split conformal: over draws, the next recording's value exceeds the limit as often as the level says, or the number
    of recordings allows; a recording of many values is still one."""
    rng, beyond = np.random.default_rng(8), []
    for _ in range(1500):
        values = rng.normal(size=recordings + 1)
        limit = conformal([np.full(1 + n % 5, v) for n, v in enumerate(values[:-1])], 0.08)
        beyond.append(values[-1] > limit)
    assert np.mean(beyond) <= level + 0.02 and np.mean(beyond) >= 0.6 * min(level, 0.08)


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


def test_a_catch_is_no_surface(model):
    x = drag("SMOOTH", 1000, 61)
    x[450:750, 0] += 3000 * np.sin(np.linspace(0, np.pi, 300))
    assert all(d.label == -1 and d.confidence == 0.0 for d in model.judge(x, WINDOW)[2:4])


def test_how_far_a_window_may_reach_is_what_windows_at_least_as_long_did(model, monkeypatch):
    quarter = model.classifiers[0]
    assert [c.length for c in model.classifiers] == [WINDOW // 4, WINDOW // 2, WINDOW]
    monkeypatch.setattr(quarter, "span", np.full(2, 1.0))
    x = drag("SMOOTH", 1000, 61)
    assert all(d.confidence == 0.0 for d in model.judge(x, quarter.length))
    assert not any(d.confidence == 0.0 for d in model.judge(x, quarter.length + 1))


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
    whole = model.judge(x, WINDOW)
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
        lambda c: c["classifiers"][0]["bias"].__setitem__(0, float("nan")),
        lambda c: c["classifiers"][0].update(length=1 << 30),
        lambda c: c["novelty"].update(length=201),
        lambda c: c["novelty"]["turn"].pop(),
        lambda c: c["novelty"]["limit"].__setitem__(3, 0.0),
        lambda c: c["novelty"]["row"].__setitem__(0, -1.0),
        lambda c: c["classifiers"][-1].update(shape=[0.0]),
        lambda c: c["classifiers"][-1].pop("shape"),
        lambda c: c.update(format="whisker texture model 9"),
        lambda c: c.update(format=None),
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
        assert code == 0 and all(set(d) == {"t_s", "loglik", "label", "best", "confidence"} for d in lines)
        assert set(lines[0]["loglik"]) == {"VINYL", "ROUGH"} and more or len(lines) == 5


def test_training_reports_figures_and_what_it_could_not_learn(capsys, tmp_path, recwarn):
    """One recording of a class, a channel that never changes, rows that are not finite, a hidden folder."""
    for name in ("VINYL", "ROUGH"):
        x = drag(name, 800, 0)
        x[:, 1], x[7] = 500.0, np.nan
        write(tmp_path / "set" / name / "0.csv", x)
    (tmp_path / "set" / ".cache").mkdir()
    code, out, error = run(capsys, "texture", "train", tmp_path / "set", "--out", tmp_path / "m.json")
    assert code == 0 and "2 classes: ROUGH, VINYL" in out and "calibration error" in out
    assert "unknown by 10 recordings: at most 18 % of new windows" in out
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
    right = rows["ROUGH"]["ROUGH"] + rows["VINYL"]["VINYL"]
    assert out.startswith(f"{100 * right / 15:.1f} % of 15 windows right; least VELVET, 0.0 %")
    assert code == 0 and len(out.splitlines()) == 5 and "folder 'VELVET' is no class" in error


@pytest.mark.parametrize("name", ["vinyl", "VINYL "])
def test_a_surface_spelt_twice_is_one_clear_line(capsys, tmp_path, name):
    for folder in ("VINYL", name):
        write(tmp_path / "set" / folder / "0.csv", drag("VINYL", 100, 0))
    code, _, error = run(capsys, "texture", "train", tmp_path / "set", "--out", tmp_path / "m.json")
    assert code != 0 and "name one surface twice" in error and error.count("\n") == 1


def windows_of(label, recording):
    return Windows(np.zeros((len(label), 0, 0)), label, np.zeros(len(label), int), recording, int(label.max()) + 1)


def test_the_temperature_is_the_most_probable_and_a_recording_counts_once():
    rng = np.random.default_rng(8)
    label = rng.integers(0, 3, 400)
    scores = rng.normal(size=(400, 3)) * 4.0
    scores[np.arange(400), label] += 1.5
    every, data = np.ones(400, bool), windows_of(label, np.arange(400))
    grid = np.exp(np.linspace(-4.0, 1.0, 2001))

    def cost(t):
        chance = np.exp(t * scores)
        right = chance[np.arange(400), label] / chance.sum(axis=1)
        return -np.log(right).sum() + 0.5 * (np.log(t / TEMPERATURE) / 0.7) ** 2

    best = grid[np.argmin([cost(t) for t in grid])]
    assert abs(temperature(data, scores, every) - best) < 0.01 * best
    separable = np.where(np.arange(3) == label[:, None], 0.0, -9.0)
    assert temperature(data, -separable, every) < 0.1 * TEMPERATURE
    copies = np.repeat(np.arange(400), np.where(np.arange(400) == 7, 500, 1))
    many = windows_of(label[copies], copies)
    assert temperature(many, scores[copies], np.ones(len(copies), bool)) == pytest.approx(best, rel=0.01)


def test_what_training_prints_are_the_decisions_that_classify_makes_of_recordings_left_out(tmp_path):
    """A model that has not seen a fold is saved, loaded and asked, as classify does."""
    made = {f"{g:g}": [hiss(s + int(10 * g), False, g, 600) for s in range(4)] for g in (0.6, 0.9, 1.4)}
    learnt = Learnt(made, RATE_HZ, 25.0, HAZARD, lambda done, of: None)
    found = []
    for fold in sorted(set(learnt.folds)):
        learnt.model(fold).save(tmp_path / "m.json")
        twin = texture.load(tmp_path / "m.json")
        for n in np.flatnonzero(learnt.folds == fold):
            t_s = np.arange(len(learnt.parts[n])) / RATE_HZ
            truth = learnt.classes[learnt.labels[n]]
            found += [(d, truth) for d in texture.classify(twin, t_s, learnt.parts[n], 25.0)]
    right = np.array([d.best == truth for d, truth in found], float)
    printed = train(made, RATE_HZ, 25.0).figures
    assert 0.6 < right.mean() < 1.0 and printed["held_out_accuracy"] == pytest.approx(right.mean(), abs=5e-3)
    assert printed["refused"] == pytest.approx(np.mean([d.label == "unknown" for d, _ in found]), abs=5e-3)
    assert printed["calibration_error"] == pytest.approx(
        calibration_error(right, np.array([d.confidence for d, _ in found])), abs=5e-3
    )


def hum(hz, seed, n=600):
    rng, t_s = np.random.default_rng(seed), np.arange(n) / RATE_HZ
    tone = 200.0 * np.sin(2.0 * np.pi * (hz * t_s + rng.uniform()))
    return np.round(32768 + tone[:, None] + rng.normal(0.0, 30.0, (n, 2)))


def test_what_training_prints_of_a_drive_is_held_out_by_place(capsys, tmp_path):
    """Tiles hum, each at a pitch of its own: who has seen one pass over a tile knows the others, and nobody knows a new tile."""
    pitches_hz = {"A": (60.0, 240.0, 560.0), "B": (120.0, 360.0, 800.0)}
    right = {}
    for known, named in ((True, "c0r{}"), (False, "t{}")):
        folder, out = tmp_path / f"{known}", tmp_path / f"{known}.json"
        for surface, tiles in pitches_hz.items():
            for n, hz in enumerate(tiles * 4):
                write(folder / surface / f"drive_floor_left_{named.format(int(hz))}_{n}.csv", hum(hz, n))
        assert run(capsys, "texture", "train", folder, "--window-ms", "25", "--out", out)[0] == 0
        right[known] = json.loads(out.read_text())["figures"]["held_out_accuracy"]
    assert right[False] > 0.95 and right[True] < 0.7


def test_folds_keep_a_place_of_each_surface_and_each_recording_where_no_place_is_known():
    made = {name: [hiss(s, False, g, 600) for s in range(6)] for name, g in (("A", 0.6), ("B", 1.4))}
    places = {"A": ["c0r0", "c1r0", "c0r0", "c2r0", "c1r0", ""], "B": ["c5r5"] * 6}
    folds = Learnt(made, RATE_HZ, 25.0, HAZARD, lambda done, of: None, places).folds
    assert folds[0] == folds[2] and folds[1] == folds[4] and len(set(folds[:6])) == 4 and len(set(folds[6:])) == 6
    alone = made | {"B": made["B"][:1]}, places | {"B": ["c5r5"]}
    folds = Learnt(alone[0], RATE_HZ, 25.0, HAZARD, lambda done, of: None, alone[1]).folds
    assert folds[0] == folds[2] and folds[1] == folds[4] and len(set(folds)) == 4 + 5


def test_a_model_without_a_fold_has_seen_nothing_of_it():
    """Whatever the recordings of a fold are, its twin's rule, temperature, doubt and limits stay the same."""
    made = recordings(("VINYL", "ROUGH"), count=3, n=1000)
    other = {name: list(group) for name, group in made.items()}
    other["ROUGH"][2] = np.round(32768 + 3.0 * (made["ROUGH"][2] - 32768))
    one, two = (Learnt(m, RATE_HZ, 100.0, HAZARD, lambda done, of: None) for m in (made, other))
    here, there = one.model(5), two.model(5)
    assert here.doubt == pytest.approx(there.doubt, rel=0.2)
    for mine, other in zip(here.classifiers, there.classifiers, strict=True):
        assert mine.behind == pytest.approx(other.behind, rel=0.3)
    for name in ("spike", "still", "low", "high"):
        assert np.array_equal(here.limits[name], there.limits[name])
    assert np.array_equal(here.classifiers[-1].span, there.classifiers[-1].span)
    assert np.allclose(here.novelty.mean, there.novelty.mean)


def test_training_is_for_the_window_asked_for(capsys, tmp_path):
    for name in ("VINYL", "ROUGH"):
        for n in range(3):
            write(tmp_path / "set" / name / f"{n}.csv", drag(name, 1000, n))
    command = ["texture", "train", tmp_path / "set", "--overwrite", "--out", tmp_path / "m.json", "--window-ms"]
    assert run(capsys, *command, "200", "--speed-m-s", "0.3", "--tile-m", "0.5")[0] == 0
    made = texture.load(tmp_path / "m.json")
    assert made.figures["window_samples"] == 400 and made.hazard == pytest.approx(0.12)
    for more, complaint in (
        ([], "--speed-m-s, --tile-m: give both"),
        (["--speed-m-s", "9"], "--speed-m-s, --tile-m: 3.6 surfaces a window"),
        (["--speed-m-s", "nan"], "argument --speed-m-s: 'nan' is not a number above 0"),
    ):
        code, _, error = run(capsys, *command, "200", "--tile-m", "0.5", *more)
        assert code != 0 and complaint in error and error.count("\n") == 1
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
