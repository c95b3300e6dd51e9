"""The robot's supervisor: what ends is started again, later each time; all end together, and say so."""

import os
import threading

import pytest
from linkkit import free_endpoint
from robotkit import take_until

from whisker.robot.children import Program
from whisker.robot.link import Link
from whisker.robot.supervisor import PAUSE_MOST_S, PAUSE_S, STEADY_S, Keeper, Supervisor

PATIENCE_S = 60.0
FAILS = Program("fails", ("sh", "-c", "echo no such arena >&2; exit 3"))
STAYS = Program("stays", ("sh", "-c", "exec sleep 1000"))


class Clock:
    def __init__(self):
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


class Kept:
    """A keeper whose child is waited for."""

    def __init__(self, program, logs):
        self.clock, self.ended = Clock(), threading.Event()
        self.keeper = Keeper(program, logs, self.ended.set, self.clock)

    def start(self) -> None:
        self.ended.clear()
        self.keeper.step()

    def end(self) -> None:
        assert self.ended.wait(PATIENCE_S)
        self.keeper.step()


def test_pauses_double_up_to_the_longest(tmp_path):
    kept = Kept(FAILS, tmp_path)
    pauses = []
    for _ in range(7):
        kept.start()
        kept.end()
        assert not kept.keeper.pid, "not at once"
        pauses.append(kept.keeper.wait_s())
        kept.clock.now += pauses[-1]
    assert pauses == pytest.approx([min(PAUSE_MOST_S, PAUSE_S * 2**n) for n in range(7)])
    assert kept.keeper.restarts == 7
    assert kept.keeper.last_error == f"fails failed (exit code 3): no such arena; log: {tmp_path / 'fails.log'}"


def test_who_ran_steadily_is_started_again_soon(tmp_path, monkeypatch):
    kept = Kept(FAILS, tmp_path)
    for _ in range(3):
        kept.start()
        kept.end()
        kept.clock.now += PAUSE_MOST_S
    monkeypatch.setattr("whisker.robot.supervisor.STEADY_S", -1.0)
    kept.start()
    kept.end()
    assert kept.keeper.wait_s() == pytest.approx(PAUSE_S) and STEADY_S > 0


def test_what_a_killed_program_leaves_behind_may_finish(tmp_path):
    """As the driver of the base, which stops the wheels when its guard is dead."""
    go, done = tmp_path / "go", tmp_path / "done"
    os.mkfifo(go)
    kept = Kept(Program("guard", ("sh", "-c", f"cat {go} >{done} & kill -9 $$")), tmp_path)
    kept.start()
    kept.end()
    assert kept.keeper.restarts == 0
    go.write_text("stopped")
    while kept.keeper.restarts == 0:
        kept.keeper.step()
    assert done.read_text() == "stopped"


def test_health_tells_of_every_end_and_all_end_with_it(tmp_path):
    endpoint, stop, answer = free_endpoint(), threading.Event(), []
    with Link("supervisor", listen=[endpoint]) as link, Link("test", connect=[endpoint]) as mine:
        inbox = mine.subscribe("health/*")
        supervisor = Supervisor([STAYS, FAILS], tmp_path, link)
        thread = threading.Thread(target=lambda: answer.append(supervisor.run(stop)))
        thread.start()
        told = [r.message for r in take_until(inbox, lambda got: any(restarts(r.message) > 1 for r in got))]
        assert any("no such arena" in health.last_error for health in told)
        running = next(health for health in told if health.process == "stays" and health.state == "running")
        assert running.pid > 0 and restarts(running) == 0
        stop.set()
        thread.join(PATIENCE_S)
        assert answer == ["stopped"]
        ended = take_until(
            inbox, lambda got: {r.message.process for r in got if r.message.state == "ended"} >= {"stays"}
        )
        assert ended[-1].message.pid == 0


def restarts(health) -> int:
    return int(health.counts["restarts"])


def test_the_end_of_the_one_that_all_need_is_the_end_of_all(tmp_path):
    ends = Program("bridge", ("true",))
    assert Supervisor([ends, STAYS], tmp_path, until="bridge").run(threading.Event()) == "bridge ended (exit code 0)"
