"""The live pilot among parts that come and go, with made-up ones: what it does, and what its health says."""

import json
import threading
from types import SimpleNamespace

import numpy as np
import pytest
from commandkit import run
from linkkit import free_endpoint
from models import model

from crunchbot import scene as scenes
from crunchbot.base_table import CREATE
from crunchbot.bridge.ring import SAMPLE
from crunchbot.commands import pilot as pilot_command
from crunchbot.pilot.base import BaseLost, Motion
from crunchbot.pilot.behaviour import BLOCK_TICKS, ODOMETRY_TICKS
from crunchbot.robot import wheels as wheels_module
from crunchbot.robot.network import messages, order
from crunchbot.robot.network.health import RUNNING
from crunchbot.robot.pilot_process import LOST, NO_HEARTBEAT, SILENCE_S, Flight, LiveFlight, LiveWheels
from crunchbot.robot.wheels import MODE, RETRY_S, LiveBase, Report, wheels_of
from crunchbot.touch.radial.model import RadialModel
from crunchbot_lab.simulation.scenes import make_scene
from whisker_protocol import LANES


class Clock:
    def __init__(self):
        self.now = 50.0

    def __call__(self) -> float:
        return self.now


class MadeUpRing:
    """Blocks as the test gives them."""

    def __init__(self):
        self.name, self.trouble = "made-up", ""
        self.restarts = self.overruns = self.ticks_missing = 0
        self.waiting = []

    def take(self, wait_s):
        made, self.waiting = self.waiting, []
        return made

    def bring(self, *firsts):
        self.waiting += [(first, np.zeros((40, 6), SAMPLE)) for first in firsts]


class MadeUpFlight:
    """Notes what it is given."""

    def __init__(self):
        self.took, self.interruptions, self.ticks_used = [], [], 0
        behaviour = SimpleNamespace(choices=None)
        self.pilot = SimpleNamespace(bad_samples=0, whisks=[], behaviour=behaviour, changed="")

    def take(self, block):
        self.took.append(block[0])
        self.wheels.drive(block[0], 0.1, 0.0)
        self.ticks_used = block[0] + 40

    def interrupted(self, tick):
        self.interruptions.append(tick)


class MadeUpBase:
    def __init__(self):
        self.trouble, self.lost, self.stops, self.drives, self.closed = "", 0, 0, 0, False

    def drive(self, tick, v_m_s, omega_rad_s):
        self.drives += 1

    def stop(self):
        self.stops += 1

    def close(self):
        self.closed = True

    def health(self):
        return {"mode": "safe"}


class MadeUpHeartbeat:
    """Beats, is silent, or has ended, as the test says."""

    beats, ended = True, False


class MadeUpLink:
    """Keeps what is sent; `navigator` is there or not."""

    process = "pilot"

    def __init__(self):
        self.peers, self.reported, self.orders = {"navigator"}, [], []

    def subscribe(self, topic):
        assert topic == order.TOPIC
        return SimpleNamespace(take=lambda timeout_s: [self.orders.pop(0) for _ in list(self.orders)])

    def publish(self, topic):
        return SimpleNamespace(send=self.reported.append, sent=0)


@pytest.fixture
def live():
    clock, ring, base, link, flight = Clock(), MadeUpRing(), MadeUpBase(), MadeUpLink(), MadeUpFlight()
    heartbeat, wheels = MadeUpHeartbeat(), LiveWheels(base)
    flight.wheels = wheels
    made = LiveFlight(flight, ring, wheels, link, heartbeat, clock)

    def steps(count=1, later=0.0):
        left = iter([False] * count)
        clock.now += later
        made.run(lambda: next(left, True))
        base.stops -= 1  # that of the end

    parts = {"clock": clock, "ring": ring, "base": base, "link": link, "flight": flight, "heartbeat": heartbeat}
    return SimpleNamespace(**parts, made=made, steps=steps)


def test_without_a_heartbeat_the_wheels_stand_and_blocks_are_read(live):
    live.ring.bring(0)
    live.steps()
    assert live.base.drives == 1
    live.heartbeat.beats = False
    live.ring.bring(40)
    live.steps()
    live.ring.bring(80)
    live.steps()
    assert live.flight.took == [0, 40, 80] and (live.base.stops, live.base.drives) == (1, 1)
    assert live.made.state == NO_HEARTBEAT
    live.heartbeat.beats = True
    live.ring.bring(120)
    live.steps()
    assert live.base.drives == 2 and live.flight.interruptions[-1] == 119 and live.made.state == RUNNING


def test_the_wheels_stand_while_a_person_wants_it_and_blocks_are_read(live):
    def ordered(state):
        return SimpleNamespace(message=messages.Behaviour(messages.Header.at(0), state, messages.Time(), "a person"))

    live.link.orders = [ordered(order.HOLD), ordered("DANCE"), SimpleNamespace(message=messages.End(None, 1, ""))]
    live.ring.bring(0, 10)
    live.steps(3)
    assert live.made._wheels.held and live.base.stops == 1 and live.flight.took == [0, 10] and not live.base.drives
    assert live.made.state.startswith("stopped by a person") and live.made._last_error == ""
    live.link.orders = [ordered(order.HOLD), ordered(order.GO)]
    live.ring.bring(20)
    live.steps(2)
    assert not live.made._wheels.held and live.made.state == "running" and live.base.stops == 1
    assert live.flight.interruptions == [19], "it begins again as after a base that was lost"


def test_the_end_of_the_heartbeat_is_the_pilots(live):
    live.heartbeat.ended = True
    live.made.run(lambda: False)
    assert live.base.stops == 1 and live.base.closed


def test_wheels_are_stopped_once_when_samples_stop_coming(live):
    live.ring.bring(0)
    live.steps()
    assert live.made.state == RUNNING and live.base.stops == 0
    live.steps(later=SILENCE_S / 2)
    assert live.base.stops == 0
    live.steps(3, later=SILENCE_S)
    assert live.base.stops == 1 and "no samples" in live.made.state
    live.ring.trouble = "ring made-up: the writer died"
    assert live.made.state == "ring made-up: the writer died"


def test_it_goes_on_as_after_a_lost_base_when_samples_are_back(live):
    live.ring.bring(0)
    live.steps()
    assert live.flight.interruptions == [], "not at the start"
    live.steps(later=2 * SILENCE_S)
    live.ring.bring(2000, 2040)
    live.steps()
    assert live.flight.interruptions == [1999] and live.flight.took == [0, 2000, 2040]
    assert live.made.state == RUNNING and live.made.counters()["halts"] == 1


def test_another_writer_of_the_ring_stops_the_wheels_however_soon_it_comes(live):
    live.ring.bring(0)
    live.steps()
    live.ring.restarts = 1
    live.steps()
    assert (live.base.stops, live.base.drives) == (1, 1)
    live.ring.bring(400)
    live.steps()
    assert live.flight.interruptions == [399] and (live.base.stops, live.base.drives) == (1, 2)
    live.steps(later=SILENCE_S)
    live.ring.restarts = 2
    live.ring.bring(4000)
    live.steps()
    assert live.base.stops == 2, "they stood already"
    assert live.made.counters()["halts"] == 2


def test_what_is_too_old_is_left_out_and_counted(live):
    live.ring.bring(*range(0, 40 * 15, 40))
    live.steps()
    assert live.flight.took == list(range(200, 600, 40)) and live.flight.interruptions == [199]
    assert live.made.counters()["blocks_left_out"] == 5


def test_health_reports_of_navigator_and_base(live):
    live.ring.bring(0)
    live.steps()
    live.link.peers, live.base.trouble = set(), "no base"
    live.steps()
    counters = live.made.counters()
    assert (counters["navigator"], counters["navigator_lost"], counters["base_mode"]) == ("gone", 1, "safe")
    assert [health.state for health in live.link.reported][-2:] == ["no base", "ended"]
    assert live.link.reported[-1].last_error == "no base"


def test_health_reports_a_whisker_that_is_not_its_models_behind_what_is_graver(live):
    live.flight.pilot.changed = "floor_left: mount: turned"
    live.ring.bring(0)
    live.steps()
    assert live.link.reported[-2].last_error == "floor_left: mount: turned"
    live.base.trouble = "no base"
    live.steps()
    assert live.link.reported[-2].last_error == "no base"


def test_the_end_stops_the_wheels_and_closes_the_base(live):
    live.made.run(lambda: True)
    assert live.base.stops == 1 and live.base.closed


def test_the_command_ends_well_when_it_is_stopped_before_anything_came(capsys, monkeypatch, tmp_path):
    stopped = threading.Event()
    stopped.set()
    monkeypatch.setattr(pilot_command, "stop_on_signals", lambda: stopped)
    scene = make_scene(5)[0]
    scenes.write(tmp_path, scene)
    model().save(tmp_path / "texture.json")
    for whisker in scene.robot.of_role("object"):
        RadialModel(-0.011, 181.5, 2.5, 90.0, 138.0).save(tmp_path / f"{whisker.name}.json")
    words = ["--models", tmp_path, "--ring", "whisker-test-no-such-ring", "--base", tmp_path / "base.sock"]
    words += ["--listen", free_endpoint(), "--report", tmp_path / "report.json"]
    code, out, err = run(capsys, "pilot", tmp_path, *words)
    assert (code, out, err) == (0, "", "")
    assert json.loads((tmp_path / "report.json").read_text())["ticks_used"] == 0


def test_a_row_is_reported_with_the_samples_at_its_end():
    """As odometry is: both are of the row's own time."""
    row, report = {"t_s": 0.1}, Report((0.01, 0.0, 0.0))
    pilot = SimpleNamespace(block=lambda *_: (0.1, 0.0), odometry=lambda *_: row)
    wheels = SimpleNamespace(drive=lambda *_: None, odometry=lambda tick: report)
    reported, nothing = [], SimpleNamespace(write=lambda *_: None)
    publisher = SimpleNamespace(row=lambda *what: reported.append(what), block=lambda last: None)
    samples = np.zeros((BLOCK_TICKS, 6), SAMPLE)
    samples["alpha"] = np.arange(BLOCK_TICKS)[:, None]
    Flight(pilot, wheels, nothing, nothing, publisher).take((ODOMETRY_TICKS - BLOCK_TICKS, samples))
    ((made, moved, last),) = reported
    assert made is row and moved is report and last["alpha"].tolist() == [BLOCK_TICKS - 1] * 6


# ---------------------------------------------------------------------------------------------------------------------


class Driver:
    """whisker-base as the client sees it; `alive` or not."""

    alive = True

    def __init__(self, path, timeout_s):
        self._ask(None)

    def _ask(self, answer):
        if not Driver.alive:
            raise BaseLost("base.sock: whisker-base has gone; look at its log, connect again")
        return answer

    def odometry(self):
        return self._ask(Motion(0.01, 0.0, 0.1, ((1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)), 2))

    def close(self):
        return None


def test_a_base_that_goes_is_reported_and_found_again(monkeypatch):
    monkeypatch.setattr(wheels_module, "Base", Driver)
    monkeypatch.setattr(Driver, "alive", False)
    clock = Clock()
    base = LiveBase("base.sock", clock)
    wheels = LiveWheels(base)
    report = wheels.odometry(199)
    assert report.motion == (0.0, 0.0, 0.0) and report.bumps == LOST and wheels.missing == 1
    assert "has gone" in base.trouble
    monkeypatch.setattr(Driver, "alive", True)
    assert wheels.odometry(399).bumps == LOST, "not tried again so soon"
    clock.now += RETRY_S
    report = wheels.odometry(599)
    assert report.motion == (0.01, 0.0, 0.1) and report.bumps.left and not report.bumps.lost
    assert np.diag(report.covariance).tolist() == [1.0, 2.0, 3.0] and base.trouble == ""
    monkeypatch.setattr(Driver, "alive", False)
    assert wheels.odometry(799).bumps == LOST and base.lost == 1


def test_a_robot_with_more_whiskers_than_lanes_is_refused(monkeypatch, capsys):
    crowd = SimpleNamespace(robot=SimpleNamespace(whiskers=[None] * (LANES + 1)))
    monkeypatch.setattr(pilot_command, "load", lambda folder: crowd)
    code, _, err = run(capsys, "pilot", "crowd", "--models", "models", "--base", "base.sock")
    assert code == 2 and err == "whisker: crowd: its robot has 29 whiskers; a bridge has 28 lanes\n"


def test_every_order_reaches_the_base(monkeypatch):
    orders = []

    class Noting:
        def __init__(self, path, timeout_s):
            orders.append(("connect", path))

        def __getattr__(self, name):
            return lambda *words: orders.append((name, *words))

    monkeypatch.setattr(wheels_module, "Base", Noting)
    base = LiveBase("base.sock")
    base.drive(39, 0.1, -0.2)
    base.recover()
    base.stop()
    base.close()
    assert orders == [("connect", "base.sock"), ("drive", 0.1, -0.2), ("mode", MODE), ("stop",), ("close",)]


def test_the_whisk_is_what_the_base_can_turn_at():
    first = wheels_of({"speed_step_m_s": "0.001000", "wheel_base_m": "0.258000"}, CREATE)
    second = wheels_of({"speed_step_m_s": "0.028500", "wheel_base_m": "0.235000"}, CREATE)
    assert first.whisk_rad_s == pytest.approx(2 * 0.017 / 0.258) and first.back_off_m_s == pytest.approx(0.03)
    assert second.whisk_rad_s == pytest.approx(2 * 0.0285 / 0.235) and second.back_off_m_s == pytest.approx(0.0285)
