"""The Pyro facade: what the paper's server did, over the same topics as everything else."""

import math
import subprocess

import numpy as np
import Pyro5.api
import pytest
from commandkit import END_S, command, run, signals_as_before  # noqa: F401 - a fixture
from linkkit import free_endpoint
from robotkit import examples, take_until

from whisker.nav.observations import ODOMETRY
from whisker.pilot.pilot import compose
from whisker.robot import messages as m
from whisker.robot.inbox import Received
from whisker.robot.link import Link
from whisker.robot.pyro import Results
from whisker.robot.rows import to_message
from whisker.robot.streams import Envelope

PATIENCE_S = 60.0


def row(n: int) -> dict:
    cells = {"l_VINYL": -1.5, "l_ROUGH": None, "front_mm": math.nan}
    return {"t_s": round(0.1 * (n + 1), 1)} | dict(zip(ODOMETRY, (0.01, 0.001 * n, 0.1), strict=True)) | cells


def observed(first: int, last: int, pose=(0.0, 0.0, 0.0), stream: int = 1):
    """Rows first .. last as received, and the sum of their motion."""
    out, pose = [], np.array(pose)
    for n in range(first, last + 1):
        message = to_message(row(n), m.EXPLORING, n, pose)
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
    told = results.pose()
    assert told == results.pose("grid") and results.pose("ekf") is None
    assert (told["filter"], told["confidence"], told["observation_seq"], told["prior"]) == (
        "grid",
        0.75,
        2**40,
        "uniform",
    )
    assert told["pose"] == pytest.approx([1.0, -2.0, 3.0]) and np.shape(told["covariance"]) == (3, 3)
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
                with pytest.raises(ValueError, match="odo_x_m: missing or not finite"):
                    netbook.write({"t_s": 1.0})
                got = take_until(inbox, lambda got: len(got) == 10, PATIENCE_S)
                listener.publish("localisation").send(examples()["localisation"])
                seen = client.observation()
                assert seen is None or seen["front_mm"] != seen["front_mm"]
            child.terminate()
            assert child.wait(END_S) == 0
            got += take_until(inbox, lambda got: any(r.over for r in got), PATIENCE_S)
        finally:
            child.kill()
            child.communicate()
    rows = [r.message for r in got if r.topic == "observation" and not r.over]
    assert [list(x.cells) for x in rows] == [[m.VALUE, m.EMPTY, m.NOT_READ]] * 5
    assert rows[-1].pose == pytest.approx(moved(range(5)))
    odometry = [r.message for r in got if r.topic == "odometry"]
    assert odometry[-1].pose.pose.xytheta == pytest.approx(tuple(moved(range(5))))


def test_a_port_that_is_taken_is_one_line(capsys):
    with Pyro5.api.Daemon("127.0.0.1", 0) as daemon:
        port = daemon.locationStr.rpartition(":")[2]
        code, _, err = run(capsys, "pyro", "--port", port, "--connect", "none")
    assert code == 1 and err.startswith(f"whisker: 127.0.0.1:{port}: cannot be listened on (") and err.count("\n") == 1
    code, _, err = run(capsys, "pyro", "--host", "here")
    assert code == 2 and "invalid address value: 'here'" in err
