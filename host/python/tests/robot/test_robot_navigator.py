"""The navigator over loopback: exact in lock-step, right when it skips, honest when it is killed or fed nonsense."""

import json
import re
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commandkit import command, run, signals_as_before  # noqa: F401 - a fixture
from fuzz_rows import fuzz
from linkkit import free_endpoint
from patience import PATIENCE_S
from robotkit import Robot, take_until, to_rows

from crunchbot import scene as scene_folder
from crunchbot.errors import UserError
from crunchbot.nav import localise
from crunchbot.nav.faults import ground_faults
from crunchbot.nav.filters import COMPONENT
from crunchbot.observation import Row
from crunchbot.occupancy import to_map
from crunchbot.robot import checkpoint
from crunchbot.robot.navigator import Navigator, Settings
from crunchbot.robot.network import belief, health, initial_pose
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.inbox import encoding_of
from crunchbot.robot.network.link import Link
from crunchbot.robot.network.ranges import COMPONENTS_MOST
from crunchbot.robot.network.rows import RowPublisher, to_message
from crunchbot_lab import scenes

ROWS = 60


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A scene folder, its scene and its rows."""
    folder = tmp_path_factory.mktemp("scene")
    made = scenes.make("robot", 4, ROWS)
    scenes.write_scene(folder, made.scene, scenes.files.rounded(made.observations))
    scene = scene_folder.load(folder)
    return folder, scene, to_rows(localise.read_observations(localise.observations_path(folder), scene), scene)


def lines(path: Path) -> list[str]:
    return path.read_text().splitlines()


def test_in_lock_step_the_process_gives_what_localise_gives(made, tmp_path):
    folder, scene, rows = made
    filters = ("adaptive", "foveal")
    options = [word for name in filters for word in ("--filter", name)]
    options += ["--out", tmp_path, "--report", tmp_path / "report.json"]
    with Robot("pose", "localisation", "belief") as robot, robot.started("navigator", folder, *options) as child:
        robot.send(rows)
        robot.rows.end("enough")
        got = take_until(robot.inbox, lambda got: sum(r.over for r in got) == 3, PATIENCE_S)
        assert child.wait(PATIENCE_S) == 0
    observations = localise.read_observations(localise.observations_path(folder), scene)
    sixfold = [{k: v if v is None or k == "t_s" else float(f"{v:.6g}") for k, v in row.items()} for row in rows]
    for name in filters:
        alone = localise.Filter(name, scene)
        expected = [alone.step(row).line(f"{row['t_s']:.6g}") for row in sixfold]
        assert lines(tmp_path / f"est_{name}.csv")[1:] == expected
        assert len(lines(tmp_path / f"covariance_{name}.csv")) == len(observations) + 1
    reported = [r.message for r in got if r.topic == "localisation" and not r.over]
    assert [x.filter for x in reported] == [*filters] * ROWS and [x.observation_seq for x in reported[::2]] == list(
        range(ROWS)
    )
    assert all((x.rows_integrated, x.rows_missed, x.first_seq, x.prior) == (1, 0, 0, "scene") for x in reported)
    poses = [r.message for r in got if r.topic == "pose" and not r.over]
    assert [p.pose.pose.xytheta for p in poses] == [x.pose.pose.xytheta for x in reported[::2]]
    beliefs = [r.message for r in got if r.topic == "belief" and not r.over]
    assert {b.filter for b in beliefs} == set(filters) and [b.observation_seq for b in beliefs][::2] == list(
        range(0, ROWS, 5)
    )
    assert all(0.998 < b.mass < 1.001 and len(b.x) <= COMPONENTS_MOST for b in beliefs)
    assert {r.message.reason for r in got if r.over} == {"enough"}
    report = json.loads((tmp_path / "report.json").read_text())
    assert (report["weighed"], report["skipped"], report["missed"], report["bad_cells"]) == (ROWS, 0, 0, 0)


def _all_over(got) -> bool:
    """The last answer and the last word of health have come, in whatever order."""
    return any(r.over for r in got) and any(getattr(r.message, "state", "") == health.ENDED for r in got)


def test_a_killed_navigator_comes_back_knowing_that_it_knows_nothing(made, tmp_path):
    folder, _, rows = made
    with Robot("localisation", "health/*") as robot:
        with robot.started("navigator", folder, "--filter", "particle", "--out", tmp_path):
            robot.send(rows[:20])
            take_until(robot.inbox, lambda got: sum(r.topic == "localisation" for r in got) == 20, PATIENCE_S)
        assert robot.link.wait_gone("navigator", PATIENCE_S)
        robot.send(rows[20:25])
        with robot.started("navigator", folder, "--filter", "particle", "--out", tmp_path) as child:
            robot.send(rows[25:])
            robot.rows.end()
            got = take_until(robot.inbox, _all_over, PATIENCE_S)
            assert child.wait(PATIENCE_S) == 0
    reported = [r.message for r in got if r.topic == "localisation" and not r.over]
    assert {(x.first_seq, x.prior, x.rows_missed) for x in reported} == {(25, "uniform", 0)} and len(
        reported
    ) == ROWS - 25
    assert reported[0].confidence < 0.1
    tally = robot.inbox.tallies["localisation"]
    assert (tally.restarts, tally.missed, tally.repeated) == (1, 0, 0)
    times = [line.split(",")[0] for line in lines(tmp_path / "est_particle.csv")]
    assert times == ["t_s", *(f"{row['t_s']:.6g}" for row in rows[:20] + rows[25:])]


def killed_and_begun_anew(robot, folder, rows, options, spoil=lambda: None):
    """Answers of a navigator that gets rows 25 on, after one that was killed behind row 20; five rows are lost."""
    with robot.started("navigator", folder, *options) as child:
        robot.send(rows[:20])
        take_until(robot.inbox, lambda got: sum(r.topic == "localisation" for r in got) == 20, PATIENCE_S)
        child.kill()
    assert robot.link.wait_gone("navigator", PATIENCE_S)
    spoil()
    robot.send(rows[20:25])
    with robot.started("navigator", folder, *options) as child:
        robot.send(rows[25:])
        robot.rows.end()
        over = take_until(robot.inbox, _all_over, PATIENCE_S)
        assert child.wait(PATIENCE_S) == 0
    reported = [r.message for r in over if r.topic == "localisation" and not r.over]
    return reported, [r.message for r in over if r.topic == "health/navigator" and not r.over]


@pytest.mark.parametrize("name", ["adaptive", "particle", "ekf"])
def test_a_killed_navigator_goes_on_from_its_checkpoint(made, tmp_path, name):
    folder, scene, rows = made
    options = ["--filter", name, "--checkpoint", tmp_path / "file"]
    with Robot("localisation", "health/navigator") as robot:
        reported, health_reported = killed_and_begun_anew(robot, folder, rows, options)
    assert {(x.first_seq, x.prior, x.rows_missed) for x in reported} == {(25, "checkpoint", 0)}
    alone = localise.Filter(name, scene)
    never_killed = [alone.step(row) for row in rows]
    for answer, expected in zip(reported, never_killed[25:], strict=True):
        off = np.hypot(*np.subtract(answer.pose.pose.xytheta[:2], expected.pose[:2]))
        assert off < 0.1, (answer.observation_seq, off)
    # The last checkpoint is of row 15: what came between it and the first row is one motion.
    assert reported[0].rows_integrated == 10 and reported[0].confidence > 0.5 * never_killed[25].confidence
    assert {x.last_error for x in health_reported} == {""} and health_reported[-1].counts["prior"] == "checkpoint"


@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (lambda file: file.write_bytes(file.read_bytes()[:-1]), "cut short or damaged"),
        (lambda file: file.write_bytes(b""), "no checkpoint"),
        (lambda file: file.write_bytes(file.read_bytes().replace(b"checkpoint 1", b"checkpoint 9", 1)), "version 9"),
    ],
)
def test_a_bad_checkpoint_is_reported_and_nothing_else_is_lost(made, tmp_path, spoil, why):
    folder, _, rows = made
    file = tmp_path / "file"
    with Robot("localisation", "health/navigator") as robot:
        options = ["--filter", "particle", "--checkpoint", file]
        reported, health_reported = killed_and_begun_anew(robot, folder, rows, options, lambda: spoil(file))
    assert {(x.first_seq, x.prior) for x in reported} == {(25, "uniform")} and len(reported) == ROWS - 25
    assert why in health_reported[-1].last_error and health_reported[-1].last_error.startswith(f"{file}: not used: ")
    assert checkpoint.load(file).seq >= 55  # written anew


class Inside:
    """A navigator within this process."""

    def __init__(self, scene, *answers, lock_step=False, **settings):
        end = free_endpoint()
        self.pilot = Link("pilot", listen=[end], lock_step=lock_step)
        self.inbox = self.pilot.subscribe(*answers)
        self.rows = RowPublisher(self.pilot)
        self.link = Link("navigator", connect=[end], lock_step=lock_step)
        self.navigator = Navigator(self.link, scene, Settings(("odometry",), **settings))
        self.link.announce()
        assert self.pilot.wait_for(["navigator"], PATIENCE_S)
        self.stop, self.counters, self.error = threading.Event(), None, None

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.stop.set()
        self.pilot.close()
        self.link.close()

    def run(self):
        try:
            self.counters = self.navigator.run(self.stop)
        except UserError as error:
            self.error = str(error)


def test_behind_by_many_rows_it_takes_the_newest_and_all_the_motion(made):
    _, scene, rows = made
    with Inside(scene, "localisation", "health/*") as inside:
        watcher = inside.link.subscribe("observation")
        for row in rows:
            inside.rows.send(Row.of(row))
        inside.rows.end("over")
        take_until(watcher, lambda got: got and got[-1].over, PATIENCE_S)
        inside.run()
        got = take_until(inside.inbox, lambda got: any(r.over for r in got), PATIENCE_S)
        reported = [r.message for r in got if r.topic == "localisation" and not r.over]
        states = [r.message for r in got if r.topic == "health/navigator"]
    assert inside.counters["weighed"] + inside.counters["skipped"] == ROWS and inside.counters["missed"] == 0
    assert (
        sum(x.rows_integrated for x in reported) == ROWS
        and len(reported) < ROWS
        and reported[-1].observation_seq == ROWS - 1
    )
    alone = localise.Filter("odometry", scene)
    every = [alone.step(row) for row in rows][-1]
    assert reported[-1].pose.pose.xytheta[:2] == pytest.approx(every.pose[:2], abs=2e-3)
    assert all(state.process == "navigator" for state in states)


@pytest.mark.parametrize(("took_s", "skipped"), [(1e-4, 0), (0.04, ROWS - 2), (0.3, ROWS - 1)])
def test_rows_that_come_late_are_weighed_as_far_as_there_is_time(made, took_s, skipped):
    _, scene, rows = made
    with Inside(scene) as inside:
        inside.navigator._weigh_s = took_s
        for row in rows:
            inside.rows.send(Row.of(row))
        inside.rows.end("over")
        inbox = inside.navigator._inbox
        with inbox._condition:  # all of them have come before it looks
            assert inbox._condition.wait_for(lambda: len(inbox._waiting) == ROWS + 1, PATIENCE_S)
        inside.run()
    assert (inside.counters["skipped"], inside.counters["missed"]) == (skipped, 0)


def test_nonsense_is_counted_and_the_rest_goes_on(made):
    _, scene, rows = made
    with Inside(scene, "localisation", lock_step=True) as inside:
        bad = m.encode(to_message(Row.of(rows[0]), 0, np.zeros(3)))[:-4]
        inside.rows._stream._publisher.put(
            bad, encoding=encoding_of(m.Observation), attachment=next(inside.rows._stream._envelopes).pack()
        )
        inside.rows.sent = 1
        for row in rows[:3]:
            inside.rows.send(Row.of(row))
        inside.rows.end()
        inside.run()
    assert (inside.counters["refused"], inside.counters["weighed"], inside.counters["missed"]) == (1, 3, 0)


def spoiled(rows, n: int) -> list[m.Observation]:
    """In place of row n, each well-formed and impossible."""
    pose = np.zeros(3)
    for k in range(n):
        pose = to_message(Row.of(rows[k]), k, pose).pose
    good = to_message(Row.of(rows[n]), n, pose)
    short = [name for name in good.names if not name.endswith("_mm")]
    far, sums = np.array([1000.0, 0.0, 0.0]), np.array([0.0, 1e5, 0.0])
    return [
        replace(good, names=short, cells=good.cells[: len(short)], values=good.values[: len(short)]),
        replace(good, names=["x" + name for name in good.names]),
        replace(good, motion=np.array([1e308, 0.0, 0.0])),
        replace(good, pose=np.array([0.0, 0.0, 1e308])),
        replace(good, motion=far, pose=good.pose + far),
        replace(good, pose=sums),
        replace(good, pose=good.pose + [0.9, 0.0, 0.0]),
        replace(good, motion=good.motion + [0.5, 0.0, 0.0], pose=good.pose + [0.5, 0.0, 0.0]),
        replace(good, seq=2**63),
        replace(good, seq=n + 1000),
        replace(good, header=m.Header(m.Time(2**31 - 1, 0))),
        replace(good, header=m.Header(m.Time(-1, 0))),
    ]


@pytest.mark.parametrize("kind", range(12))
def test_a_row_that_cannot_be_is_refused_and_the_pose_is_as_without_it(made, kind):
    """It comes in the pilot's own stream, where a row should be; those after it bring its motion, as of one missed."""
    _, scene, rows = made
    place, reported = 20, []
    for hostile in (True, False):
        with Inside(scene, "localisation", "health/navigator", lock_step=True) as inside:
            stream = inside.rows._stream
            for n, row in enumerate(rows):
                if n != place:
                    inside.rows.send(Row.of(row))
                    continue
                sound = to_message(Row.of(row), n, inside.rows.pose)
                if hostile:
                    stream.send(spoiled(rows, place)[kind])
                else:
                    next(stream._envelopes)  # lost on the way
                inside.rows.pose, inside.rows.sent = sound.pose, n + 1
            inside.rows.end()
            inside.run()
            got = take_until(inside.inbox, _all_over, PATIENCE_S)
        reported.append([r.message.pose.pose.xytheta for r in got if r.topic == "localisation" and not r.over])
        health_reported = [r.message for r in got if r.topic == "health/navigator" and not r.over][-1]
        assert (inside.counters["refused"], inside.counters["weighed"]) == (hostile, ROWS - 1)
        assert inside.counters["missed"] == 1 and inside.error is None
        assert (
            health_reported.last_error.startswith("observation: field ") == hostile
            and "\n" not in health_reported.last_error
        )
        assert health_reported.counts["refused"] == str(int(hostile))
    assert reported[0] == reported[1]


@pytest.mark.parametrize("mapped", [True, False])
def test_answers_on_ground_that_nobody_mapped_are_reported_as_of_a_file(made, monkeypatch, mapped):
    monkeypatch.setattr("crunchbot.robot.row_watch.ROWS", ROWS)
    _, scene, rows = made
    unknown = () if mapped else ((0.0, 0.0, *scene.arena.size_m),)
    scene = replace(scene, arena=replace(scene.arena, unknown=unknown))
    with Inside(scene, "localisation", "health/navigator", lock_step=True) as inside:
        for row in rows:
            inside.rows.send(Row.of(row))
        inside.rows.end()
        inside.run()
        got = take_until(inside.inbox, _all_over, PATIENCE_S)
    poses = [r.message.pose.pose.xytheta for r in got if r.topic == "localisation" and not r.over]
    given = ground_faults(np.array(poses), scene)
    health_reported = [r.message for r in got if r.topic == "health/navigator" and not r.over][-1]
    assert len(given) != mapped and health_reported.last_error == "".join(f"rows: {line}" for line in given)


def test_rows_of_another_robot_are_refused_by_name_and_the_navigator_stays(made):
    _, scene, rows = made
    with Inside(scene, "health/navigator", lock_step=True) as inside:
        for row in rows[:3]:
            inside.rows.send(Row.of({k: v for k, v in row.items() if not k.endswith("_mm")}))
        inside.rows.end()
        inside.run()
        got = take_until(inside.inbox, lambda got: got and got[-1].message.state == health.ENDED, PATIENCE_S)
    assert inside.error is None and inside.counters["refused"] == 3 and inside.counters["weighed"] == 0
    assert re.fullmatch(
        r"observation: field names: cell \w+_mm is missing; give both sides the scene of this robot",
        got[-1].message.last_error,
    )


def test_a_second_pilot_is_refused_and_reported(made):
    _, scene, rows = made
    with Inside(scene, "localisation", "health/navigator", lock_step=True) as inside:
        thread = threading.Thread(target=inside.run)
        thread.start()
        inside.rows.send(Row.of(rows[0]))
        take_until(inside.inbox, lambda got: any(r.topic == "localisation" for r in got), PATIENCE_S)
        second = RowPublisher(inside.pilot)
        for row in rows[:5]:
            second.send(Row.of(row))
        reported = take_until(
            inside.inbox,
            lambda got: any(r.topic != "localisation" and r.message.counts["refused"] == "5" for r in got),
            PATIENCE_S,
        )
        inside.rows.send(Row.of(rows[1]))
        inside.rows.end()
        thread.join()
    assert (inside.counters["refused"], inside.counters["weighed"], inside.counters["restarts"]) == (5, 2, 0)
    assert "of a second source; end one of the two" in reported[-1].message.last_error


def test_a_navigator_that_stays_goes_on_with_the_next_run(made):
    _, scene, rows = made
    with Inside(scene, "localisation", lock_step=True, stay=True) as inside:
        thread = threading.Thread(target=inside.run)
        thread.start()
        for publisher in (inside.rows, RowPublisher(inside.pilot)):
            for row in rows[:4]:
                publisher.send(Row.of(row))
            publisher.end()
            got = take_until(inside.inbox, lambda got: len(got) == 4, PATIENCE_S)
            assert not any(r.over for r in got)
        inside.stop.set()
        thread.join()
    assert inside.counters["restarts"] == 1


def test_condensed_beliefs_keep_mass_place_and_width():
    rng = np.random.default_rng(8)
    components = np.zeros(30_000, COMPONENT)
    components["pose"] = rng.normal([1.0, 2.0, 3.1], [0.3, 0.1, 0.2], (len(components), 3))
    components["sigma_m"], components["sigma_rad"], components["mass"] = 0.01, 0.02, rng.random(len(components))
    components["mass"] /= components["mass"].sum()
    few = belief.condense(components)
    assert 100 < len(few) <= COMPONENTS_MOST and np.all(np.diff(few["mass"]) <= 0.0)
    assert few["mass"].sum() == pytest.approx(1.0, abs=belief.NEGLECTED)
    for one in (components, few):
        weight = one["mass"] / one["mass"].sum()
        mean = weight @ one["pose"][:, :2]
        assert mean == pytest.approx([1.0, 2.0], abs=0.01)
        off = ((one["pose"][:, :2] - mean) ** 2).sum(1)
        assert weight @ (off / 2.0 + one["sigma_m"] ** 2) == pytest.approx((0.3**2 + 0.1**2) / 2.0 + 1e-4, rel=0.03)
        heading = np.angle(weight @ np.exp(1j * one["pose"][:, 2]))
        assert heading == pytest.approx(3.1, abs=0.01)


def test_a_belief_of_everywhere_keeps_its_width():
    components = np.zeros(20_000, COMPONENT)
    components["pose"] = np.random.default_rng(2).uniform([0.0, 0.0, -np.pi], [6.0, 6.0, np.pi], (len(components), 3))
    components["mass"] = 1.0 / len(components)
    few = belief.condense(components)
    share = few["mass"] / few["mass"].sum()
    off = few["pose"][:, :2] - share @ few["pose"][:, :2]
    width = share @ ((off**2).sum(1) / 2.0 + few["sigma_m"] ** 2)
    assert width == pytest.approx(components["pose"][:, :2].var(axis=0).mean(), rel=2e-3)
    assert 0.05 < np.median(few["sigma_m"]) < 0.4 and 0.02 < np.median(few["sigma_rad"]) < 1.0


def test_small_beliefs_are_sent_as_they_are():
    components = np.zeros(3, COMPONENT)
    components["pose"], components["mass"] = [[1, 2, 3], [4, 5, 6], [7, 8, 9]], [0.2, 0.5, 0.3]
    reported = belief.to_message(m.Header(), "grid", 4, len(components), belief.condense(components))
    assert (
        list(reported.x) == [4, 7, 1]
        and list(reported.theta) == [6, 9, 3]
        and (reported.components, reported.mass) == (3, 1.0)
    )
    empty = belief.to_message(m.Header(), "grid", 4, 0, belief.condense(components[:0]))
    assert (len(empty.x), empty.components, empty.mass) == (0, 0, 0.0)


def test_two_hypotheses_stay_two():
    components = np.zeros(20_000, COMPONENT)
    components["pose"] = np.random.default_rng(1).normal(0.0, 0.05, (20_000, 3))
    components["pose"][::2] += [1.0, 0.0, np.pi]
    components["mass"] = 1.0 / len(components)
    few = belief.condense(components)
    near = np.abs(np.sin(few["pose"][:, 2] / 2.0)) < 0.5
    assert few["mass"][near].sum() == pytest.approx(0.5, abs=1e-3) and len(few) <= COMPONENTS_MOST


def test_health_is_reported_at_once_when_the_state_is_new(monkeypatch):
    reported, now = [], [10.0]

    class Sink:
        process = "pilot"

        def publish(self, topic):
            assert topic == "health/pilot"
            return self

        send = reported.append

    monkeypatch.setattr(health.time, "monotonic", lambda: now[0])
    speaker = health.Health(Sink(), lambda: {"rows": len(reported)})
    for at, state in ((10.0, "running"), (10.5, "running"), (10.6, "waiting"), (11.5, "waiting"), (11.7, "waiting")):
        now[0] = at
        speaker.report(5, state)
    assert [(x.state, x.counts["rows"]) for x in reported] == [("running", "0"), ("waiting", "1"), ("waiting", "2")]


def test_options_of_the_command(made, capsys):
    folder, _, _ = made
    code, _, err = run(capsys, "navigator", folder, "--filter", "magic")
    assert code == 2 and "magic" in err and err.count("\n") == 1
    code, _, err = run(capsys, "navigator", folder, "--connect", "nowhere")
    assert code == 2 and err == "whisker: 'nowhere': not an endpoint; give tcp/HOST:PORT, as tcp/127.0.0.1:7458\n"
    code, _, err = run(capsys, "navigator", folder, "--listen", "tcp/0.0.0.0:1x", "--connect", "none")
    assert code == 2 and "not an endpoint" in err
    code, _, err = run(capsys, "navigator", folder, "--listen", "tcp/192.0.2.1:7459")
    assert code == 1 and "anyone who reaches this address can watch" in err and "cannot be listened on" in err
    code, _, err = run(capsys, "navigator", folder / "none")
    assert code == 2 and "no such folder" in err


def test_messages_that_cannot_be_change_nothing_that_comes_of_the_others():
    """Navigator and Pyro server, with 4000 of them among 40 rows: see fuzz_rows, which runs for long by its front."""
    counts = fuzz(4000, seed=5)
    assert all(count >= 2000 for count in counts.values()) and len(counts) == 2


def _errors(got) -> list[str]:
    return [r.message.last_error for r in got if getattr(r.message, "last_error", "")]


def test_a_pose_that_is_reported_while_running_is_gone_on_from(made):
    folder, scene, rows = made
    far_place = (scene.arena.size_m[0] - 0.4, scene.arena.size_m[1] - 0.4, -2.0)

    def answers(robot, topic: str, wanted) -> list:
        """A row at a time until a message is as wanted: the last two of them."""
        seen = [None]
        while not wanted(seen[-1]):
            robot.send([next(left)])
            seen += [r.message for r in take_until(robot.inbox, len, PATIENCE_S) if r.topic == topic]
        first = next(n for n, message in enumerate(seen) if wanted(message))
        return seen[first - 1], seen[first]

    left = iter(rows)
    with Robot("localisation", "health/navigator") as robot, robot.started("navigator", folder, "--filter", "adaptive"):
        answers(robot, "localisation", lambda x: x and x.prior == "scene")
        initial_pose.send(robot.link, far_place, (0.02, 0.02, 0.02))
        before, after = answers(robot, "localisation", lambda x: x and x.prior == "given")
        apart = [np.hypot(*np.subtract(x.pose.pose.xytheta, far_place)[:2]) for x in (before, after) if x]
        assert apart[-1] < 0.1 and (before is None or apart[0] > 0.5)
        initial_pose.send(robot.link, (-1.0, 0.0, 0.0))
        errors = []
        take_until(robot.inbox, lambda got: errors.extend(_errors(got)) or errors, PATIENCE_S)
        wanted = "initial_pose: (-1, 0) is outside the arena, which is within (0, 0) and (2.5, 2.5); give a place that is free"
        assert errors[0] == wanted


def test_a_reported_pose_has_a_frame_and_a_width(made):
    scene = replace(made[1], origin=(-10.0, -3.0, 1.0))
    free = next((x, y, 0.5) for x in (0.8, 1.2, 1.7) for y in (0.8, 1.2, 1.7) if scene.arena.is_free(x, y, 0.1))
    place = tuple(to_map(np.array([free]), scene.origin)[0].tolist())

    def message(frame: str, *sigma: float, pose=place):
        planar = m.PoseWithCovariance.planar(pose, np.diag(np.square(sigma)))
        return m.PoseWithCovarianceStamped(m.Header.at(0, frame), planar)

    prior = initial_pose.prior_of(message("map", 0.3, 0.3, 0.3), scene)
    assert prior.mean == pytest.approx(place) and prior.sigma == pytest.approx((0.3,) * 3)
    assert initial_pose.prior_of(message("", 1e-9, 1e-9, 1e-9), scene).sigma == (initial_pose.FINEST,) * 3
    with pytest.raises(initial_pose.InitialPoseError, match="frame 'odom'; give a pose in frame 'map'"):
        initial_pose.prior_of(message("odom", 0.3, 0.3, 0.3), scene)
    assert initial_pose.prior_of(message("", 0.0, 0.0, 0.0), scene).sigma == initial_pose.SIGMA
    assert initial_pose.prior_of(message("", 0.2, 0.1, 0.0), scene).sigma == pytest.approx((0.2, 0.1, np.pi / 12))
    upside_down = message("map", 0.3, 0.3, 0.3)
    for turn in ((0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)):
        upside_down.pose.pose.orientation = m.Quaternion(*turn)
        with pytest.raises(
            initial_pose.InitialPoseError, match=r"orientation \([01], 0, 0, 0\) has no heading; give z = "
        ):
            initial_pose.prior_of(upside_down, scene)
    x0, y0, x1, y1 = scene.arena.obstacles[0]
    wall = to_map(np.array([((x0 + x1) / 2, (y0 + y1) / 2, 0.0)]), scene.origin)[0].round(2).tolist()
    for pose, fault in ((wall, "in an obstacle"), ((1.0, 2.0, 0.5), "outside the arena")):
        with pytest.raises(initial_pose.InitialPoseError, match=rf"\({pose[0]:g}, {pose[1]:g}\) is {fault}"):
            initial_pose.prior_of(message("map", 0.3, 0.3, 0.3, pose=pose), scene)
    tied = message("map", 0.3, 0.3, 0.3)
    tied.pose.covariance[[1, 6]], tied.pose.covariance[[5, 30]] = 0.05, -0.08
    sigma = initial_pose.prior_of(tied, scene).sigma
    left = np.diag(np.square(sigma)) - tied.pose.planar_covariance
    assert np.linalg.eigvalsh(left).min() > -1e-9 and max(sigma) < 0.6, "in no direction narrower than given"
