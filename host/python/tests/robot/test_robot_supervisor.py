"""The robot's supervisor: what ends is started again, later each time; all end together, and say so."""

import errno
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import injector
import pytest
from linkkit import free_endpoint
from patience import PATIENCE_S
from robotkit import take_until

from crunchbot.errors import UserError
from crunchbot.robot.network.link import Link
from crunchbot.robot.processes.children import Child, Program, living
from crunchbot.robot.processes.lifeline import BEAT_S
from crunchbot.robot.processes.parts import LEAVE_ENVIRONMENT
from crunchbot.robot.processes.supervisor import PAUSE_MOST_S, PAUSE_S, Keeper, RunError, Supervisor

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


def test_who_ran_steadily_is_started_again_at_once(tmp_path):
    kept = Kept(replace(STAYS, steady_s=0.0), tmp_path)
    kept.start()
    first = kept.keeper.pid
    os.kill(first, signal.SIGKILL)
    assert kept.ended.wait(PATIENCE_S)
    kept.keeper.step()
    assert kept.keeper.restarts == 1 and kept.keeper.pid not in (0, first)
    kept.keeper.close()


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


def test_what_a_killed_program_leaves_behind_stopped_is_killed(tmp_path):
    """A stopped driver cannot stop the wheels: another base has to come at once."""
    kept = Kept(Program("guard", ("sh", "-c", "sleep 1000 & kill -STOP $!; kill -9 $$")), tmp_path)
    kept.start()
    kept.end()
    assert await_true(lambda: kept.keeper.step() or kept.keeper.restarts == 1)
    assert [group for group in groups(tmp_path) if living(group)] == []


def test_a_program_that_cannot_be_started_is_tried_again(tmp_path):
    kept = Kept(Program("none", (str(tmp_path / "no-such-program"),)), tmp_path)
    before = len(os.listdir("/proc/self/fd"))
    for number in range(1, 4):
        kept.keeper.step()
        assert kept.keeper.restarts == number and "cannot be started (No such file" in kept.keeper.last_error
        kept.clock.now += kept.keeper.wait_s()
    assert len(os.listdir("/proc/self/fd")) == before, "nothing stays open"


@pytest.mark.parametrize("number", [errno.EMFILE, errno.EAGAIN, errno.ENOMEM])
def test_want_of_files_or_processes_ends_nothing(tmp_path, monkeypatch, number):
    def refuse(*_, **__):
        raise OSError(number, os.strerror(number))

    kept = Kept(STAYS, tmp_path)
    with monkeypatch.context() as patched:
        patched.setattr("subprocess.Popen", refuse)
        kept.keeper.step()
    assert os.strerror(number) in kept.keeper.last_error and not kept.keeper.pid
    kept.clock.now += PAUSE_S
    kept.keeper.step()
    assert kept.keeper.pid
    kept.keeper.close()


def test_a_log_folder_that_is_removed_is_made_again(tmp_path):
    kept = Kept(FAILS, tmp_path / "logs")
    for number in range(1, 3):
        kept.start()
        shutil.rmtree(tmp_path / "logs")
        kept.end()
        assert kept.keeper.restarts == number and kept.keeper.last_error.startswith("fails failed (exit code 3)")
        kept.clock.now += PAUSE_MOST_S


def test_wrong_arguments_end_the_run_with_their_line(tmp_path):
    wrong = Program("wrong", ("sh", "-c", "echo no such scene >&2; exit 2"))
    with pytest.raises(UserError, match=r"wrong failed \(exit code 2\): no such scene; log: ") as reported:
        Supervisor([STAYS, wrong], tmp_path).run(threading.Event())
    assert reported.value.exit_code == 2


def test_who_ran_steadily_has_no_wrong_arguments(tmp_path):
    kept = Kept(Program("late", ("sh", "-c", "exit 2"), steady_s=0.0), tmp_path)
    kept.start()
    kept.end()
    assert kept.keeper.restarts == 1 and not kept.keeper.refused
    kept.keeper.close()


def test_a_program_that_hangs_is_started_again(tmp_path):
    """It says that it is ready, and then feeds no watchdog."""
    says = "import os, socket, time; s = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)"
    says += "; s.sendto(b'READY=1\\nSTATUS=up', '\\0' + os.environ['NOTIFY_SOCKET'][1:]); time.sleep(1000)"
    stop, supervisor = threading.Event(), None
    supervisor = Supervisor([Program("hangs", (sys.executable, "-c", says), fed=True)], tmp_path)
    thread = threading.Thread(target=supervisor.run, args=[stop])
    thread.start()
    assert await_true(
        lambda: (tmp_path / "hangs.log").exists() and "signal SIGKILL" in (tmp_path / "hangs.log").read_text()
    )
    stop.set()
    thread.join(PATIENCE_S)


def test_a_stopped_program_can_be_ended_in_order(tmp_path):
    child = Child(
        Program("stopped", ("sh", "-c", "trap 'exit 7' TERM; echo up; while :; do sleep 0.01; done")), tmp_path / "log"
    )
    assert await_true(lambda: "up" in child.log.read_text())
    os.kill(child.process.pid, signal.SIGSTOP)
    child.close()
    assert child.process.returncode == 7


SUPERVISED = """
import sys, threading
from pathlib import Path
from crunchbot.robot.processes.children import Program
from crunchbot.robot.processes.supervisor import Supervisor
folder = Path(sys.argv[1])
grandchildren = Program("grandchildren", ("sh", "-c", "sleep 1000 & sleep 1000"))
plain = Program("plain", ("sleep", "1000"))
mover = Program("mover", (sys.executable, "-c", sys.argv[2], str(folder)), moves=True)
Supervisor([grandchildren, mover, plain], folder).run(threading.Event())
"""
MOVER = """
import sys, time
from pathlib import Path
from crunchbot.robot.processes.lifeline import Heartbeat
heart, reported = Heartbeat.of_environment(), ""
while True:
    now = "ended" if heart.ended else "beats" if heart.beats else "silent"
    if now != reported:
        reported = now
        (Path(sys.argv[1]) / now).touch()
    time.sleep(0.01)
"""


@pytest.fixture
def supervised(tmp_path):
    """A supervisor as a process, with its children in groups of their own."""
    process = subprocess.Popen([sys.executable, "-c", SUPERVISED, tmp_path, MOVER])
    assert await_true(lambda: (tmp_path / "beats").exists() and (tmp_path / "plain.log").exists())
    yield process, tmp_path
    process.kill()
    process.wait()


def groups(folder) -> list[int]:
    """The process groups of the children, by those of their logs that have a line yet."""
    begun = (re.search(r"started as process (\d+)", log.read_text()) for log in folder.glob("*.log"))
    return [int(line[1]) for line in begun if line]


def test_a_killed_supervisor_leaves_nobody_behind(supervised):
    process, folder = supervised
    assert await_true(lambda: len(groups(folder)) == 3) and all(map(living, groups(folder)))
    process.kill()
    assert await_true(lambda: not any(map(living, groups(folder))))


def test_a_killed_shell_of_the_simulated_bridge_leaves_nobody_behind(tmp_path):
    """Bridge and supervisor may be killed at once: then nobody is left who could end what the shell has started."""
    words = ["sh", "-c", LEAVE_ENVIRONMENT, tmp_path / "environment"]
    shell = subprocess.Popen(words, env=os.environ | {"UMOCKDEV_DIR": "/nowhere"}, start_new_session=True)
    assert await_true(lambda: (tmp_path / "environment").exists() and len(living(shell.pid)) == 2)
    shell.kill()
    shell.wait()
    gone = await_true(lambda: not living(shell.pid))
    if not gone:
        os.killpg(shell.pid, signal.SIGKILL)
    assert gone


def test_who_can_move_wheels_notices_a_supervisor_that_hangs(supervised):
    process, folder = supervised
    os.kill(process.pid, signal.SIGSTOP)
    assert await_true((folder / "silent").exists)
    (folder / "beats").unlink()
    os.kill(process.pid, signal.SIGCONT)
    assert await_true((folder / "beats").exists)


def await_true(wanted) -> bool:
    """Wait until `wanted()`; False: it never was."""
    until = time.monotonic() + PATIENCE_S
    while not wanted():
        if time.monotonic() > until:
            return False
        time.sleep(0.01)
    return True


def test_it_rests_between_two_looks_and_never_longer_than_heartbeats_are_apart(tmp_path, monkeypatch):
    stop, rests, looks = threading.Event(), [], 4

    def step(keeper):
        looked.append(keeper)
        if len(looked) == looks:
            stop.set()

    looked = []
    monkeypatch.setattr(Keeper, "step", step)
    supervisor = Supervisor([STAYS], tmp_path)
    monkeypatch.setattr(supervisor, "_woken", SimpleNamespace(set=lambda: None, clear=lambda: None, wait=rests.append))
    assert supervisor.run(stop) == "stopped"
    assert len(rests) == looks and all(0.0 <= rest <= BEAT_S for rest in rests)


def test_health_reports_of_every_end_and_all_end_with_it(tmp_path):
    endpoint, stop, answer = free_endpoint(), threading.Event(), []
    with Link("supervisor", listen=[endpoint]) as link, Link("test", connect=[endpoint]) as mine:
        inbox = mine.subscribe("health/*")
        supervisor = Supervisor([STAYS, FAILS], tmp_path, link)
        thread = threading.Thread(target=lambda: answer.append(supervisor.run(stop)))
        thread.start()
        reported = [r.message for r in take_until(inbox, lambda got: any(restarts(r.message) > 1 for r in got))]
        assert any("no such arena" in health.last_error for health in reported)
        running = next(health for health in reported if health.process == "stays" and health.state == "running")
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
    with pytest.raises(RunError, match="fails failed"):
        Supervisor([FAILS, STAYS], tmp_path, until="fails").run(threading.Event())


# Asked to end, it does so when another was asked, too.
MEETS = 'trap "touch $0; while [ ! -e $1 ]; do sleep .01; done; echo met; exit 0" TERM; touch $2; while :; do sleep .01; done'


def test_what_moves_no_wheels_is_ended_all_at_once_between_the_movers_and_the_one_that_all_need(tmp_path):
    """One after the other they take longer than who pressed Ctrl-C waits."""
    asked, ready, order = tmp_path / "asked", tmp_path / "ready", tmp_path / "order"
    asked.mkdir(), ready.mkdir()

    def meets(name: str, other: str) -> Program:
        return Program.of(name, ["sh", "-c", MEETS, asked / name, asked / other, ready / name])

    def notes(name: str, **options) -> Program:
        script = 'trap "ls $0 >>$1; echo $2 >>$1; exit 0" TERM; touch $3; while :; do sleep .01; done'
        return Program.of(name, ["sh", "-c", script, asked, order, name, ready / name], **options)

    table = [notes("bridge"), meets("a", "b"), meets("b", "a"), notes("base", moves=True), notes("pilot", moves=True)]
    stop = threading.Event()
    thread = threading.Thread(target=Supervisor(table, tmp_path, until="bridge").run, args=(stop,))
    thread.start()
    assert await_true(lambda: len(list(ready.iterdir())) == len(table))
    stop.set()
    thread.join()
    assert order.read_text().split() == ["pilot", "base", "a", "b", "bridge"]
    assert all("met" in (tmp_path / f"{name}.log").read_text() for name in "ab")


def test_what_never_ran_says_so_once_after_the_third_try(tmp_path):
    lines: list[str] = []
    kept = Kept(FAILS, tmp_path)
    kept.keeper._tell = lines.append
    for number in range(1, 6):
        kept.start()
        kept.end()
        kept.clock.now += kept.keeper.wait_s()
        assert len(lines) == (number >= 3)
    log = tmp_path / "fails.log"
    assert lines == [f"fails failed (exit code 3): no such arena; log: {log}; it has never run, and is tried again"]
    steady = Kept(replace(STAYS, steady_s=0.0), tmp_path)
    steady.keeper._tell = lines.append
    for _ in range(4):
        steady.start()
        os.killpg(steady.keeper.pid, signal.SIGKILL)
        steady.end()
    assert len(lines) == 1


FAULTS = """
import errno, os, resource, sys, threading, time
from pathlib import Path
import injector
from crunchbot.robot.processes.children import Program
from crunchbot.robot.processes.supervisor import Keeper

place = Path(sys.argv[1])
RUNS = 3


def life(logs: Path, ran: Path, tight: bool) -> int:
    \"\"\"A program that fails, RUNS times. How often it could be started. tight: no descriptor is left while it ends.\"\"\"
    ended, now, started = threading.Event(), [0.0], 0
    program = Program("fails", ("sh", "-c", f"echo >>{ran}; echo it fails >&2; exit 1"), moves=True, fed=True)
    keeper = Keeper(program, logs, ended.set, lambda: now[0])
    for _ in range(RUNS):
        ended.clear()
        now[0] += 10.0
        keeper.step()
        if keeper._child:
            started += 1
            ended.wait()
            limits = resource.getrlimit(resource.RLIMIT_NOFILE)
            if tight:
                resource.setrlimit(resource.RLIMIT_NOFILE, (3, limits[1]))
            while not keeper.settled():
                time.sleep(0.001)
            resource.setrlimit(resource.RLIMIT_NOFILE, limits)
    assert keeper.restarts == RUNS and keeper.last_error.startswith("fails "), keeper.last_error
    keeper.close()
    return started


def tried(name: str, prepare, tight: bool = False) -> tuple[int, int, int]:
    \"\"\"In a process of its own: (how often it was started, 99: something was raised; how often it ran; operations).\"\"\"
    folder = place / name
    folder.mkdir()
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            prepare(folder / "logs")
            code = life(folder / "logs", folder / "ran", tight)
        except BaseException as error:
            print(name, repr(error), file=sys.stderr)
            code = 99
        os.write(writing, str(injector.counted()).encode())
        os._exit(code)
    os.close(writing)
    with open(reading) as pipe:
        count = int(pipe.read())
    code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    return code, len((folder / "ran").read_text().splitlines()) if (folder / "ran").exists() else 0, count


code, ran, operations = tried("whole", injector.arm)
assert (code, ran) == (RUNS, RUNS) and operations > 3 * RUNS, (code, ran, operations)
assert tried("tight", lambda logs: None, True)[:2] == (RUNS, RUNS)
ends = 1
for error in (errno.ENOSPC, errno.EIO, errno.EMFILE):
    for lasts in (False, True):
        for at in range(1, operations + 1):
            name = f"{errno.errorcode[error]}-{lasts}-{at}"
            code, ran, _ = tried(name, lambda logs: injector.arm(logs, at, error, lasts))
            assert (code, ran) == (RUNS, RUNS), (name, code, ran)
            ends += 1
held = len(os.listdir("/proc/self/fd"))
for more in range(30):
    limit = lambda logs: resource.setrlimit(resource.RLIMIT_NOFILE, (held + more, held + more))
    code, ran, _ = tried(f"descriptors-{more}", limit)
    assert code == ran <= RUNS, (more, code, ran)
    ends += 1
assert code == RUNS
print(operations, ends)
"""


def test_no_file_operation_of_a_supervisor_decides_over_its_processes(tmp_path):
    """Each fails in turn, once and from then on: no room, broken, no descriptor. All that is kept is what was said."""
    library = injector.build(tmp_path)
    environment = injector.environment(library) | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    (tmp_path / "tries").mkdir()
    words = [sys.executable, "-c", FAULTS, tmp_path / "tries"]
    done = subprocess.run(words, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
