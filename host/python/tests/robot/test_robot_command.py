"""`whisker robot`: which processes it starts, by its options."""

import os
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import pytest
from commandkit import run, signals_as_before  # noqa: F401 - a fixture
from keykit import documented, made_keys  # noqa: F401 - a fixture
from linkkit import free_endpoint, free_port
from patience import PATIENCE_S
from robotkit import examples

from crunchbot import scene as scenes
from crunchbot.bridge.ring import Writer
from crunchbot.cli import main, parser_of
from crunchbot.commands import robot
from crunchbot.robot.network.link import Link
from crunchbot.robot.processes import holders, parts
from crunchbot.robot.processes.children import Program
from crunchbot.view import command as view
from crunchbot_lab.demo import training
from crunchbot_lab.simulation.scenes import make_scene

# As the simulation does it: the true pose to each client that connects. Its argument: a socket.
TELLS_TRUTH = """
import socket, sys, time
with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as server:
    server.bind(sys.argv[1])
    server.listen()
    watcher, _ = server.accept()
    while True:
        watcher.send(b"truth 0 2.0 1.0 0.0")
        time.sleep(0.02)
"""


@pytest.fixture(autouse=True)
def _own_cache(monkeypatch, tmp_path):
    """Models that other tests or the user kept are not this test's."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def begun(monkeypatch, capsys, tmp_path):
    """A call: what the command says on both outputs with these options; it starts nothing, for it is stopped before."""
    stopped = threading.Event()
    stopped.set()
    monkeypatch.setattr(robot, "stop_on_signals", lambda: stopped)

    monkeypatch.setattr(robot, "load_models", lambda folder, robot: ({}, {}))
    scenes.write(tmp_path / "scene", make_scene(5)[0])

    def said(*options) -> tuple[str, str]:
        ports = ["--first-port", free_port(3), "--view-port", 0]
        place = ["--out", tmp_path, *ports, "--ring", "whisker-test-robot-command"]
        code, out, err = run(capsys, "robot", tmp_path / "scene", "--models", tmp_path, *place, *options)
        assert code == 0, err
        return out, err

    return said


@pytest.fixture
def started(begun):
    """A call: the processes that the command would start with these options."""
    return lambda *options: begun(*options)[0].removeprefix("starting ").partition(";")[0].split(", ")


@pytest.fixture
def commands(monkeypatch, begun):
    """A call: what each command of `whisker` in the process table is given with these options, as it understands it."""
    tables = []

    class Noted(robot.Supervisor):
        def __init__(self, table, *more):
            tables.append(table)
            super().__init__(table, *more)

    monkeypatch.setattr(robot, "Supervisor", Noted)
    beginning = parts.whisker("")[:-1]

    def understood(*options) -> dict:
        begun(*options)
        words = [program.command[len(beginning) :] for program in tables[-1] if "crunchbot.cli" in program.command]
        return {line[0]: parser_of(line[0]).parse_args(line) for line in words}

    return understood


def test_a_netbook_has_daemon_base_and_pilot(started):
    assert started() == ["whiskerd", "base", "pilot"]


def test_a_daemon_that_runs_already_is_used(started):
    assert started("--no-daemon") == ["base", "pilot"]


def test_the_desktops_side_is_added(started):
    assert started("--desktop") == ["navigator", "bag", "view", "whiskerd", "base", "pilot"]
    assert started("--desktop", "--no-view", "--no-daemon") == ["navigator", "bag", "base", "pilot"]


@pytest.mark.parametrize("given", [False, True])
def test_a_simulated_robot_learns_its_own_whiskers(capsys, monkeypatch, tmp_path, given):
    """Models of other whiskers read floors wrong: those that learn are those of the simulation, batch, sensor and all."""
    learnt = []
    monkeypatch.setattr("crunchbot_lab.demo.training.learn", lambda models, scene, *_: learnt.append(scene))
    stopped = threading.Event()
    stopped.set()
    monkeypatch.setattr(robot, "stop_on_signals", lambda: stopped)
    scenes.write(tmp_path / "given", make_scene(5)[0])
    options = [tmp_path / "given"] if given else []
    code, _, err = run(
        capsys,
        "robot",
        *options,
        "--simulated",
        "--board",
        "pico",
        "--seed",
        7,
        "--out",
        tmp_path / "out",
        "--first-port",
        free_port(3),
    )
    assert code == 0, err
    flown = (tmp_path / "out/scene.flat").read_text().splitlines()
    robots = [
        [
            line
            for line in text
            if line.split()[0] in ("mechanics", "batch", "sensor", "texture_whisker", "object_whisker")
        ]
        for text in (flown, training.flat(learnt[0]).splitlines())
    ]
    assert robots[0] == robots[1] and {"batch 7", "sensor tmag5170"} <= set(robots[0])
    with pytest.raises(ValueError, match="simulated"):
        training.flat(scenes.load(tmp_path / "out/scene" if not given else tmp_path / "given"))


def test_a_simulated_robot_learns_once_and_nothing_where_models_are_given(capsys, monkeypatch, tmp_path):
    learnt, stopped = [], threading.Event()
    stopped.set()
    monkeypatch.setattr(robot, "stop_on_signals", lambda: stopped)

    def learn(models, *_):
        learnt.append(models)
        models.mkdir(exist_ok=True)
        (models / "texture.json").write_text(f"{len(learnt)}")

    monkeypatch.setattr("crunchbot_lab.demo.training.learn", learn)
    common = ["robot", "--simulated", "--out", tmp_path / "out", "--first-port"]
    for options in ([], [], ["--models", tmp_path / "out/models"], ["--models", tmp_path]):
        run(capsys, *common, free_port(3), *options)
    assert [models.name for models in learnt] == ["models"] and (tmp_path / "out/models/texture.json").exists()
    run(capsys, "robot", "--simulated", "--out", tmp_path / "again", "--first-port", free_port(3))
    assert len(learnt) == 1 and (tmp_path / "again/models/texture.json").read_text() == "1"
    run(capsys, "robot", "--simulated", "--seed", 2, "--out", tmp_path / "other", "--first-port", free_port(3))
    assert len(learnt) == 2 and (tmp_path / "other/models/texture.json").read_text() == "2"


@pytest.fixture
def refused(capsys, monkeypatch, tmp_path):
    """A call: (exit code, line) of a start that is refused. Nothing is started, and nobody is waited for."""
    monkeypatch.setattr(robot, "Supervisor", None)

    def line(*options, port=None) -> tuple[int, str]:
        place = ["--out", tmp_path, "--first-port", port or free_port(3), "--ring", "whisker-test-robot-command"]
        code, out, err = run(capsys, "robot", *options, *place)
        assert out == "" and err.count("\n") == 1, err
        return code, err

    return line


@pytest.fixture
def given(monkeypatch, tmp_path):
    """Scene and models that are right."""
    monkeypatch.setattr(robot, "load_models", lambda folder, robot: ({}, {}))
    scenes.write(tmp_path / "scene", make_scene(5)[0])
    return [tmp_path / "scene", "--models", tmp_path]


@pytest.mark.parametrize(
    "options, complaint",
    [
        (["--simulated", "--no-daemon"], "only a whiskerd of its own sees that bridge"),
        (["nosuch"], "no SCENE or no --models"),
        (["nosuch", "--models", "nosuch"], "nosuch"),
    ],
)
def test_what_cannot_be_is_one_line(refused, options, complaint):
    code, line = refused(*options)
    assert code == 2 and complaint in line


def test_models_are_looked_at_before_anything_starts(refused, tmp_path):
    scenes.write(tmp_path / "scene", make_scene(5)[0])
    code, line = refused(tmp_path / "scene", "--models", tmp_path / "nosuch")
    assert code == 2 and "nosuch/texture.json" in line


def test_who_holds_a_port_is_named(refused, given):
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        for first in (port, port - 2):
            code, line = refused(*given, port=first)
            assert code == 1 and f"port {port} of 127.0.0.1" in line and f"process {os.getpid()} (" in line
            assert "--first-port" in line
        code, line = refused(*given, "--desktop", "--view-port", port)
        assert code == 1 and f"process {os.getpid()} (" in line and "--view-port" in line


def test_nobody_else_is_named_who_has_a_socket(monkeypatch, tmp_path):
    """A table of the kernel's: a listener at the port, one at another, and a connection of the first one's client."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        sockets = [(port, "0A"), (port + 1, "0A"), (port, "01")]
        lines = [
            f"{n}: 0100007F:{at:04X} 00000000:0000 {state} 0:0 0:0 0 0 0 {100 + n} 1"
            for n, (at, state) in enumerate(sockets)
        ]
        (tmp_path / "net").mkdir()
        (tmp_path / "net/tcp").write_text("\n".join(["sl local_address rem_address st", *lines]))
        (tmp_path / "net/tcp6").write_text("sl local_address rem_address st\n")
        for n in range(len(sockets)):
            (tmp_path / f"{41 + n}/fd").mkdir(parents=True)
            (tmp_path / f"{41 + n}/fd/3").symlink_to(f"socket:[{100 + n}]")
        monkeypatch.setattr(holders, "PROC", tmp_path)
        with pytest.raises(holders.HeldError, match=r", by process 41 \(gone\); end that"):
            holders.check_port("127.0.0.1", port, "--first-port")


def test_the_simulation_is_the_one_that_was_asked_for(tmp_path):
    simulated = parts.Simulated(tmp_path / "flat", "bytes", 7, 2.5, 0.5, tmp_path / "truth", tmp_path / "wheels")
    body = parts.Body(tmp_path, tmp_path, 2, tmp_path / "port", 7)
    words = parts.bridge(simulated, body, parts.Meeting("ring", tmp_path)).command
    words = words[: words.index("--")]
    reported = {"scene": tmp_path / "flat", "seconds": 2.5, "seed": 7, "level": "bytes", "pace": 0.5, "create": 2}
    assert {name: words[words.index(f"--{name}") + 1] for name in reported} == {n: str(v) for n, v in reported.items()}


def test_who_writes_the_ring_is_named(refused, given):
    with Writer("whisker-test-robot-command", 64):
        code, line = refused(*given)
    assert code == 1 and f"by process {os.getpid()} (" in line and "--no-daemon" in line


def test_who_has_the_serial_port_is_named_but_not_its_emulator(refused, given, tmp_path):
    main, held = os.openpty()
    link = tmp_path / "port"
    link.symlink_to(os.ttyname(held))
    assert holders.check_serial(link) == ""  # this process is at the other end: so is an emulator
    with subprocess.Popen(["sleep", "60"], stdin=held) as other:
        code, line = refused(*given, "--port", link)
        other.kill()
    os.close(main)
    os.close(held)
    assert code == 1 and f"by process {other.pid} (sleep" in line and "--port" in line
    assert str(os.getpid()) not in line


def test_a_port_that_is_not_there_is_said_once(started, capsys, tmp_path):
    warning = holders.check_serial(tmp_path / "none")
    assert f"{tmp_path}/none: there is no such port yet" in warning
    assert started("--port", tmp_path / "none") == ["whiskerd", "base", "pilot"]


def test_a_simulated_robot_needs_the_laboratory(refused, monkeypatch):
    """As where only the product is installed."""
    for name in [name for name in sys.modules if name.partition(".")[0] == "crunchbot_lab"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "crunchbot_lab", None)
    code, line = refused("--simulated")
    assert code == 2 and "robot: --simulated" in line and "pip install --find-links dist 'crunchbot[lab]'" in line


WHISKER_COMMANDS = {"pilot", "navigator", "bag", "view"}


def endpoints(arguments) -> list[str]:
    return (getattr(arguments, "listen", None) or []) + arguments.connect


def test_every_process_gets_the_configuration_of_zenoh(commands, keys):
    file = documented(keys, "pilot")
    given = commands("--desktop", "--zenoh-config", file)
    assert given.keys() == WHISKER_COMMANDS
    assert {name: arguments.zenoh_config for name, arguments in given.items()} == dict.fromkeys(given, file)
    assert all(end.startswith("tls/127.0.0.1:") for arguments in given.values() for end in endpoints(arguments))


def test_without_a_configuration_of_zenoh_nothing_is_encrypted(commands):
    given = commands("--desktop")
    assert {name: arguments.zenoh_config for name, arguments in given.items()} == dict.fromkeys(WHISKER_COMMANDS)
    assert all(end.startswith("tcp/127.0.0.1:") for arguments in given.values() for end in endpoints(arguments))


def test_a_robot_that_is_open_to_the_network_says_so_once(begun, keys, tmp_path):
    line = "0.0.0.0:{}: anyone who reaches this address can watch and take part\n"
    open_to_all = begun("--listen", "0.0.0.0", "--first-port", port := free_port(3))[1]
    assert f"whisker: tcp/{line.format(port)}" in open_to_all and open_to_all.count("anyone") == 1
    guarded = documented(keys, "pilot")
    assert "anyone" not in begun("--listen", "0.0.0.0", "--zenoh-config", guarded)[1]
    assert "anyone" not in begun()[1]
    one_sided = tmp_path / "one-sided.json5"
    one_sided.write_text(guarded.read_text().replace("enable_mtls: true", "enable_mtls: false"))
    words = ["--listen", "0.0.0.0", "--first-port", port := free_port(3), "--zenoh-config", one_sided]
    assert f"whisker: tls/{line.format(port)}" in begun(*words)[1]


def test_what_is_no_configuration_of_zenoh_is_one_line_and_starts_nothing(refused, given, tmp_path):
    file = tmp_path / "zenoh.json5"
    file.write_text("{unheard_of: 1}")
    code, line = refused(*given, "--zenoh-config", file)
    assert code == 2 and line.startswith(f"whisker: {file}: no configuration of zenoh")
    assert not (tmp_path / "logs").exists()


def test_certificates_that_are_not_there_are_one_line(refused, given, tmp_path):
    file = tmp_path / "zenoh.json5"
    file.write_text("{}")
    code, line = refused(*given, "--port", file, "--zenoh-config", file)
    assert code == 1 and "tls/127.0.0.1:" in line and f"mend {file}" in line


@pytest.fixture
def stand_ins(monkeypatch):
    """What the process table holds once the command has made it: in each process's place one that only waits, or tells
    the truth."""
    table, made = [], robot._table

    def stand_in(program: Program, meeting: parts.Meeting) -> Program:
        tells = program.name == parts.BRIDGE
        command = [sys.executable, "-c", TELLS_TRUTH, meeting.simulation] if tells else ["sleep", "1000"]
        return Program.of(program.name, command, reports=program.reports)

    def waiting(arguments, meeting, files):
        table[:] = [stand_in(program, meeting) for program in made(arguments, meeting, files)]
        return table

    monkeypatch.setattr(robot, "_table", waiting)
    return table


@pytest.fixture
def supervised(monkeypatch, given, tmp_path, stand_ins):
    """A supervisor of stand-ins with the options of a call, until the test is over; gives what becomes its exit code."""
    stop = threading.Event()
    monkeypatch.setattr(robot, "stop_on_signals", lambda: stop)
    place = ["--simulated", "--desktop", "--view-port", 0, "--ring", "whisker-test-robot-command", "--out", tmp_path]
    with ThreadPoolExecutor(1) as pool:
        yield lambda *options: pool.submit(main, [str(word) for word in ("robot", *given, *place, *options)])
        stop.set()


def test_with_the_documented_configuration_view_hears_the_supervisor(supervised, stand_ins, keys):
    """It believes the netbook's certificate about health and truth, and not that of another view."""
    port, guests_end = free_port(3), free_endpoint().replace("tcp/", "tls/")
    forged = {"health/base": examples()["health/pilot"], "truth": examples()["truth"]}
    ends = [word for end in (f"tls/127.0.0.1:{port}", guests_end) for word in ("--connect", end)]
    file, heard = documented(keys, "view"), []
    ended = supervised("--first-port", port, "--zenoh-config", documented(keys, "pilot"))
    with (
        Link("view", listen=[guests_end], config=file) as guest,
        closing(view._source(parser_of("view").parse_args(["view", *ends, "--zenoh-config", str(file)]))) as source,
    ):
        streams = {topic: guest.publish(topic) for topic in forged}
        give_up_s = time.monotonic() + PATIENCE_S
        while not stand_ins or {topic for topic, _ in heard} < expected(stand_ins) or len(heard) < 50:
            assert time.monotonic() < give_up_s and not ended.done(), sorted({topic for topic, _ in heard})
            for topic, message in forged.items():
                streams[topic].send(message)
            heard += source.poll()
            time.sleep(0.01)
    assert {topic for topic, _ in heard} == expected(stand_ins) and source.refused()["count"] == 0
    assert {message.process for topic, message in heard if topic == "health/base"} == {"base"}
    assert {message.pose.position.x for topic, message in heard if topic == "truth"} == {2.0}


def expected(table: list[Program]) -> set[str]:
    """The topics of a supervisor of a simulated robot."""
    return {"truth"} | {f"health/{program.name}" for program in table if not program.reports}
