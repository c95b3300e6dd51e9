"""The Pyro facade: what the paper's server did, over the same topics as everything else."""

import contextlib
import json
import marshal
import math
import socket
import struct
import subprocess
import threading
import zlib
from dataclasses import replace

import numpy as np
import Pyro5.api
import pytest
import serpent
from commandkit import command, run, signals_as_before  # noqa: F401 - a fixture
from linkkit import free_endpoint, sample
from patience import PATIENCE_S
from robotkit import examples, take_until

from crunchbot import observation as o
from crunchbot.observation import ODOMETRY, Row
from crunchbot.pilot.pilot import compose
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.inbox import Inbox, Received
from crunchbot.robot.network.link import Link
from crunchbot.robot.network.row_checks import RowChecks
from crunchbot.robot.network.rows import to_message
from crunchbot.robot.network.streams import Envelope
from crunchbot.robot.pyro import NAMES_MOST, Results, Server
from crunchbot.robot.pyro_daemon import REQUEST_MOST


def row(n: int) -> dict:
    motion = (0.01, 0.001 * (n % 25), 0.1)
    cells = {"l_VINYL": -1.5, "l_ROUGH": None, "front_mm": math.nan}
    return {"t_s": round(0.1 * (n + 1), 1)} | dict(zip(ODOMETRY, motion, strict=True)) | cells


def observed(first: int, last: int, pose=(0.0, 0.0, 0.0), stream: int = 1):
    """Rows first .. last as received, and the sum of their motion."""
    out, pose = [], np.array(pose)
    for n in range(first, last + 1):
        message = to_message(Row.of(row(n)), n, pose)
        out.append(Received("observation", message, Envelope(stream, n, 0)))
        pose = message.pose
    return out, pose


def moved(numbers) -> np.ndarray:
    total = np.zeros(3)
    for n in numbers:
        total = compose(total, [row(n)[name] for name in ODOMETRY])
    return total


def test_a_client_behind_gets_all_the_motion_it_missed():
    results = Results(None, may_write=False)
    assert results.observation() is None and results.odometry() is None and results.pose() is None
    first, pose = observed(0, 9)
    results.take(first)
    seen = results.observation()
    assert seen["number"] == 10 and seen["t_s"] == 1.0 and seen["l_VINYL"] == -1.5 and seen["l_ROUGH"] is None
    assert seen["motion"] == pytest.approx(moved([9])) and math.isnan(seen["front_mm"])
    later, _ = observed(10, 24, pose)
    results.take(later[:3])
    results.take(later[8:])
    assert results.observation(10)["motion"] == pytest.approx(moved(range(10, 25)))
    assert results.observation(0)["motion"] == pytest.approx(moved(range(25)))
    assert results.observation(25)["motion"] == [0.0, 0.0, 0.0]
    assert results.observation(26)["motion"] is None and results.observation(-1)["motion"] is None
    assert results.observation(15)["motion"] is None  # a row that never came: only the next knows
    assert results.counters() == {"rows": 20, "missed": 5, "restarts": 0}


def test_poses_odometry_and_health_are_the_newest():
    results, shown = Results(None, may_write=False), examples()
    results.take(
        [Received(topic, shown[topic], Envelope(1, 0, 0)) for topic in ("odometry", "localisation", "health/pilot")]
    )
    reported = results.pose()
    assert reported == results.pose("grid") and results.pose("ekf") is None
    assert (reported["filter"], reported["confidence"], reported["observation_seq"], reported["prior"]) == (
        "grid",
        0.75,
        2**40,
        "uniform",
    )
    assert reported["pose"] == pytest.approx([1.0, -2.0, 3.0]) and np.shape(reported["covariance"]) == (3, 3)
    assert results.odometry()["absolute"] == pytest.approx([1.0, -2.0, 3.0])
    assert results.health() == {"pilot": {"state": "running", "last_error": "none yet", "rows": "7"}}


def test_what_is_no_row_is_not_written():
    with pytest.raises(PermissionError, match="start it with --write"):
        Results(None, may_write=False).write(row(0))
    results = Results(None, may_write=True)
    for name, value in (("l_VINYL", "x"), ("front_mm", True), ("t_s", None), ("odo_x_m", math.nan)):
        with pytest.raises(ValueError, match=name):
            results.write(row(0) | {name: value})


def test_a_netbook_writes_and_clients_read_over_the_network():
    endpoint = free_endpoint()
    with Link("pilot", listen=[endpoint], lock_step=True) as listener:
        inbox = listener.subscribe("observation", "odometry")
        options = ["--connect", endpoint, "--port", "0", "--write", "--lock-step"]
        child = subprocess.Popen(command("pyro", *options), stdout=subprocess.PIPE, text=True)
        try:
            uri = child.stdout.readline().strip()
            assert uri.startswith("PYRO:whisker.results@127.0.0.1:")
            assert listener.wait_for(["pyro"], PATIENCE_S)
            with Pyro5.api.Proxy(uri) as netbook, Pyro5.api.Proxy(uri) as client:
                assert [netbook.write(row(n)) for n in range(5)] == list(range(5))
                with pytest.raises(ValueError, match="odo_x_m: missing or no number"):
                    netbook.write({"t_s": 1.0})
                got = take_until(inbox, lambda got: len(got) == 10, PATIENCE_S)
                listener.publish("localisation").send(examples()["localisation"])
                seen = client.observation()
                assert seen is None or seen["front_mm"] != seen["front_mm"]
            child.terminate()
            assert child.wait(PATIENCE_S) == 0
            got += take_until(inbox, lambda got: any(r.over for r in got), PATIENCE_S)
        finally:
            child.kill()
            child.communicate()
    rows = [r.message for r in got if r.topic == "observation" and not r.over]
    assert [list(x.cells) for x in rows] == [[o.VALUE, o.EMPTY, o.NOT_READ]] * 5
    assert rows[-1].pose == pytest.approx(moved(range(5)))
    odometry = [r.message for r in got if r.topic == "odometry"]
    assert odometry[-1].pose.pose.xytheta == pytest.approx(tuple(moved(range(5))))


class Sink:
    """A link whose streams keep what is sent."""

    def __init__(self):
        self.sent = []

    def publish(self, topic):
        return self

    def send(self, message):
        self.sent.append(message)


IMPOSSIBLE = [
    {"odo_x_m": 1e308},
    {"odo_x_m": 1.1},
    {"odo_theta_rad": 10**400},
    {"odo_theta_rad": -3.2},
    {"odo_y_m": 0.9},
    {"t_s": 1e300},
    {"t_s": -1.0},
    {"t_s": 2.0**31},
    {"x" * 200: 1.0},
    {"\ud800": 1.0},
    {f"cell{n}": 1.0 for n in range(600)},
]


@pytest.mark.parametrize("change", IMPOSSIBLE)
def test_a_row_that_cannot_be_is_not_written_and_the_next_is(change):
    link = Sink()
    results = Results(link, may_write=True)
    assert results.write(row(0)) == 0
    with pytest.raises(ValueError) as refused:  # noqa: PT011 - of each its own text
        results.write(row(1) | change)
    assert type(refused.value) is ValueError and "\n" not in str(refused.value)
    assert results.write(row(1)) == 1
    assert [x.seq for x in link.sent if isinstance(x, m.Observation)] == [0, 1]
    for bad in (None, [1], "t_s"):
        with pytest.raises(ValueError, match="row: not cells by name"):
            results.write(bad)


def test_rows_that_cannot_be_leave_the_answers_right():
    results, inbox = Results(None, may_write=False), Inbox("", None, judge=RowChecks())
    for one in observed(0, 9)[0]:
        good = one.message
        jump, huge = (replace(good, pose=good.pose + [far, 0.0, 0.0]) for far in (0.9, 1e308))
        for row in (jump, huge, good):
            inbox.put(sample("observation", row, one.envelope))
        results.take(inbox.take(0.0))
    assert results.observation(0)["motion"] == pytest.approx(moved(range(10))) and results.observation()["number"] == 10
    assert inbox.refused == 20 and "field pose" in inbox.last_error


def test_names_that_are_made_up_take_no_room():
    results, shown = Results(None, may_write=False), examples()
    for n in range(3000):
        reported = replace(shown["health/pilot"], process=f"p{n}"), replace(shown["localisation"], filter=f"f{n}")
        results.take([Received("localisation", one, Envelope(1, n, 0)) for one in reported])
    assert len(results.health()) == len(results._answers) == NAMES_MOST


@contextlib.contextmanager
def serving(may_write: bool = False):
    """A server within this process, with the link that it listens to."""
    endpoint = free_endpoint()
    with Link("pilot", listen=[endpoint], lock_step=True) as pilot, Link("pyro", connect=[endpoint]) as link:
        server, stop = Server(link, "127.0.0.1", 0, may_write), threading.Event()
        thread = threading.Thread(target=server.run, args=[stop])
        thread.start()
        try:
            assert pilot.wait_for(["pyro"], PATIENCE_S)
            yield server, pilot
        finally:
            stop.set()
            thread.join(PATIENCE_S)


def address(server: Server) -> tuple[str, int]:
    host, _, port = server.uri.rpartition("@")[2].partition(":")
    return host, int(port)


def test_silent_connections_lock_nobody_out():
    """200 that never say a word and 100 that greet and fall silent: those that speak are served."""
    with serving() as (server, _), contextlib.ExitStack() as stack:
        for _ in range(200):
            stack.enter_context(socket.create_connection(address(server), PATIENCE_S))
        for _ in range(100):
            stack.enter_context(Pyro5.api.Proxy(server.uri))._pyroBind()
        for _ in range(5):
            with Pyro5.api.Proxy(server.uri) as client:
                client._pyroTimeout = PATIENCE_S
                assert client.pose() is None


def raw(server: Server, payload: bytes, serializer: int, flags: int = 0) -> bytes:
    """What comes back on a greeting with these bytes, until the connection is closed or reset."""
    head = b"PYRO" + struct.pack("!HBBHHII16sHH", 502, 1, serializer, flags, 0, len(payload), 0, bytes(16), 0, 0x4DC5)
    answer = b""
    with socket.create_connection(address(server), PATIENCE_S) as client:
        # A server that refuses what it has read so far closes with bytes unread, which resets the connection.
        with contextlib.suppress(OSError):
            client.sendall(head + payload)
            client.shutdown(socket.SHUT_WR)
        with contextlib.suppress(ConnectionResetError):
            while data := client.recv(65536):
                answer += data
    return answer


def test_only_small_plain_requests_in_pyros_own_serializer_are_read(monkeypatch):
    read = []
    monkeypatch.setattr("marshal.loads", read.append)
    with serving() as (server, _):
        greeting = {"handshake": "hello", "object": "whisker.results"}
        plain = serpent.dumps(greeting)
        for serializer, payload in ((2, marshal.dumps(greeting)), (3, json.dumps(greeting).encode()), (4, b"\x80")):
            assert b"whisker" not in raw(server, payload, serializer)
        assert b"meta" not in raw(server, zlib.compress(plain), 1, flags=2)
        assert b"meta" not in raw(server, plain + b" " * REQUEST_MOST, 1)
        assert b"meta" in raw(server, plain, 1)
        with Pyro5.api.Proxy(server.uri) as client:
            assert client.pose() is None
    assert read == [] and Pyro5.config.COMMTIMEOUT > 0


def test_a_listener_that_fails_ends_the_server(monkeypatch):
    """A server that no longer hears the robot does not stay with old answers."""
    with Link("pyro") as link:
        server = Server(link, "127.0.0.1", 0)
        monkeypatch.setattr(server._results, "take", lambda received: 1 / 0)
        stop, raised = threading.Event(), []

        def run():
            try:
                server.run(stop)
            except ZeroDivisionError as error:
                raised.append(error)

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        thread.join(PATIENCE_S)
        stop.set()
        assert raised


def test_a_port_that_is_taken_is_one_line(capsys):
    with Pyro5.api.Daemon("127.0.0.1", 0) as daemon:
        port = daemon.locationStr.rpartition(":")[2]
        code, _, err = run(capsys, "pyro", "--port", port, "--connect", "none")
    assert code == 1 and err.startswith(f"whisker: 127.0.0.1:{port}: cannot be listened on (") and err.count("\n") == 1
    code, _, err = run(capsys, "pyro", "--host", "here")
    assert code == 2 and "here is not an address" in err
