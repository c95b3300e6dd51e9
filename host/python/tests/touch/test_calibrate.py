"""`whisker calibrate`: what it writes from a ring is what was in it, and the radial model learns from it."""

import tomllib
from types import SimpleNamespace

import numpy as np
import pytest
from commandkit import run, signals_as_before  # noqa: F401 - a fixture
from rings import make_frames, ring_name

from crunchbot.bridge.ring import FRAME, Writer
from crunchbot.touch.calibration import CalibrationError, Feed, WhiskFinder, measure_rest
from crunchbot.touch.contact import REST_SAMPLES
from crunchbot.touch.radial.model import RadialModel, peak, read_whisks
from crunchbot_lab.signals.recordings import radial_contacts
from crunchbot_lab.simulation.scenes import make_scene

LANE = 3
RADII = (90.0, 110.0, 130.0)
REPEATS = 2


@pytest.fixture(scope="module")
def whisks():
    """Body whisks of the simulated robot against a post, radius by radius."""
    scene, start = make_scene(4)
    return radial_contacts(scene.flat(start), "object_2", 4, REPEATS, radii_mm=RADII)


def frames_of(counts: np.ndarray, lane: int = LANE) -> np.ndarray:
    """Frames in which one lane does this and the others rest."""
    frames = make_frames(len(counts))
    frames["lane_mask"] = 0x3F
    frames["lane"]["status"] = 0
    frames["lane"]["alpha"][:, lane], frames["lane"]["beta"][:, lane] = counts.T
    return frames


@pytest.fixture
def ring(whisks):
    # Half a second before each: the plug creeps, and comes back to rest some time after the whisker is let go.
    pauses = [np.tile(whisk.counts[:100], (10, 1)) for whisk in whisks]
    frames = frames_of(
        np.concatenate([part for pair in zip(pauses, (w.counts for w in whisks), strict=True) for part in pair])
    )
    with Writer(ring_name(), 1 << 16) as writer:
        writer.publish(frames)
        yield writer


def test_contacts_at_known_distances(capsys, tmp_path, ring, whisks):
    options = ["--radii", ",".join(map(str, RADII)), "--repeats", REPEATS, "--rest-seconds", 0.5, "--yes", "--backlog"]
    code, out, err = run(capsys, "calibrate", "--ring", ring.name, "--out", tmp_path, "--lane", LANE, *options)
    assert (code, err) == (0, "") and "6 contacts, places left out: RMS error" in out
    found = read_whisks(tmp_path / "lane3.csv", with_radius=True)
    assert found.radius_mm.tolist() == [r for r in RADII for _ in range(REPEATS)]
    true_peaks = [peak(w.counts, np.median(w.counts[: REST_SAMPLES // 4], axis=0)) for w in whisks]
    assert found.peak_counts == pytest.approx(true_peaks, abs=25)
    ours, theirs = (RadialModel.fit(p, found.radius_mm) for p in (found.peak_counts, np.array(true_peaks)))
    assert ours.predict(true_peaks[2])[0] == pytest.approx(theirs.predict(true_peaks[2])[0], abs=0.5)
    assert run(capsys, "radial", "fit", tmp_path / "lane3.csv", "--out", tmp_path / "m.json")[0] == 0


def test_one_distance_gives_no_error_estimate(capsys, tmp_path, ring):
    options = ["--radii", "90", "--repeats", 6, "--rest-seconds", 0.5, "--yes", "--backlog"]
    code, out, err = run(capsys, "calibrate", "--ring", ring.name, "--out", tmp_path, "--lane", LANE, *options)
    reported = out.splitlines()[-1]
    assert (code, err) == (0, "") and "6 contacts; " in reported and "standard error" not in out
    assert "at 90 mm, and one radius gives no error estimate; record contacts at more radii" in reported
    code, _, err = run(capsys, "radial", "fit", tmp_path / "lane3.csv", "--out", tmp_path / "m.json")
    assert code == 2 and "one radius gives no error estimate" in err and err.count("\n") == 1
    assert not (tmp_path / "m.json").exists()


def test_rest_and_noise_of_every_lane(capsys, tmp_path, ring):
    code, out, _ = run(
        capsys, "calibrate", "--ring", ring.name, "--out", tmp_path, "--rest-seconds", 0.5, "--yes", "--backlog"
    )
    lanes = tomllib.loads((tmp_path / "rest.toml").read_text())["lane"]
    assert code == 0 and [lane["lane"] for lane in lanes] == list(range(6)) and lanes[0]["name"] == "lane0"
    assert lanes[0]["rest"] == pytest.approx([0x8000, 0x8000], abs=3) and lanes[0]["noise"] == pytest.approx(
        [11, 11], abs=2
    )
    assert not (tmp_path / "lane3.csv").exists()


def test_a_lane_that_moves_or_fails_is_reported():
    frames = make_frames(1000)
    frames["lane_mask"] = 0b111
    frames["lane"]["alpha"][:, 0] = np.arange(1000)
    frames["lane"]["status"] = 0
    frames["lane"]["status"][:, 1] = 32 << 10
    moving, failing, fine = measure_rest(frames)
    assert (
        "it moves; leave it untouched" in moving.trouble and "whisker doctor" in failing.trouble and fine.trouble == ""
    )
    assert np.isnan(failing.mean).all() and failing.bad == 1000


def test_guided_it_waits_for_enter_and_forgets_what_came_before(capsys, tmp_path, ring, monkeypatch, whisks):
    asked = []

    class Person:
        def readline(self):
            """Moves the post, touching the whisker; then whisks as asked."""
            asked.append(None)
            count = 3 * len(whisks[0].counts) if len(asked) > 1 else 2000
            self.after = np.concatenate([whisks[0].counts[:100]] * 10 + [whisk.counts for whisk in whisks[:3]])[:count]

    person = Person()
    monkeypatch.setattr("sys.stdin", person)
    skip = Feed.skip

    def skip_and_go_on(feed):
        skip(feed)
        if asked:  # what the person does after Enter
            frames = frames_of(person.after)
            frames["tick"] += len(asked) * 10**6
            ring.publish(frames)

    monkeypatch.setattr(Feed, "skip", skip_and_go_on)
    options = ["--lane", LANE, "--radii", "90,110", "--repeats", 2, "--rest-seconds", 0.5]
    code, out, _ = run(capsys, "calibrate", "--ring", ring.name, "--out", tmp_path, *options)
    assert code == 0 and len(asked) == 3 and out.count("press Enter") == 3 and "Post at 110 mm" in out
    assert len(read_whisks(tmp_path / "lane3.csv", with_radius=True).contact) == 4


def test_one_frame_is_enough_to_go_on_and_none_is_reported():
    takes = iter([make_frames(1), make_frames(0)])
    feed = Feed(SimpleNamespace(name="made-up", take=lambda wait_s: next(takes)))
    assert len(feed.next()) == 1
    with pytest.raises(CalibrationError, match="ring made-up: no frames for .* s; see whisker doctor"):
        feed.next()


def test_a_bridge_started_anew_ends_it():
    finder = WhiskFinder(0)
    list(finder.add(make_frames(100)))
    with pytest.raises(CalibrationError, match="started anew"):
        list(finder.add(make_frames(100)))


def test_wrong_use_is_one_line(capsys, tmp_path, ring):
    for options, complaint in (
        (["--lane", "3"], "--lane and --radii belong together"),
        (["--lane", "3", "--radii", "90,x"], "'x' is not a number above 0"),
        (["--lane", "28", "--radii", "90"], "from 0 to 27"),
    ):
        code, _, err = run(capsys, "calibrate", "--ring", ring.name, "--out", tmp_path, *options)
        assert code == 2 and complaint in err and err.count("\n") == 1
    (tmp_path / "file").write_text("")
    code, _, err = run(capsys, "calibrate", "--ring", ring.name, "--out", tmp_path / "file", "--yes")
    assert code == 2 and "cannot be written" in err
    ring.publish(np.empty(0, FRAME))
    ring.close()
    code, _, err = run(capsys, "calibrate", "--ring", ring.name, "--out", tmp_path, "--yes")
    assert code == 1 and "there is no ring" in err
