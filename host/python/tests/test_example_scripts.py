"""The examples as a user runs them, on the data set that `whisker examples` unpacks."""

import importlib.util
import socket
import subprocess
import sys
import threading
from itertools import pairwise
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("user") / "examples"
    command = [sys.executable, "-m", "crunchbot.cli", "examples", folder]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


def example(name: str):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_own_map_and_own_sensor_find_the_robot(data, capsys):
    assert example("own_map").main(data) < 0.1
    rows = int(capsys.readouterr().out.split()[0])
    assert 20 < rows < 150, "the whisker touches the map's cupboard on a part of the way"


def test_own_data_train_both_models_of_touch(data):
    right, errors = example("own_touch").main(data)
    assert right > 0.9
    assert set(errors) == {"paper", "default"} and all(0.0 < mm < 12.0 for mm in errors.values())


def test_every_filter_is_measured_and_drawn(data, tmp_path, capsys):
    from crunchbot.nav import localise

    chart = tmp_path / "filters.svg"
    found = example("compare_filters").main(data / "scene", chart)
    assert list(found) == localise.filter_names()
    assert all(us > 0.0 and error < found["odometry"][1] for name, (us, error) in found.items() if name != "odometry")
    drawn = chart.read_text()
    assert "<svg" in drawn and drawn.count("<use") > len(found)
    assert len(capsys.readouterr().out.splitlines()) == len(found) + 1


class Clock:
    """Time that passes by sleeping alone."""

    def __init__(self):
        self.now = 0.0

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.now = round(self.now + seconds, 6)


def test_moves_are_ordered_again_before_the_base_stops_them(tmp_path, monkeypatch, capsys):
    heard, clock = [], Clock()
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as door:
        door.bind(str(tmp_path / "base.sock"))
        door.listen()

        def serve():
            with door.accept()[0] as client:
                while message := client.recv(256):
                    heard.append((clock.now, message.decode()))
                    client.send(b"odometry 1 0 0 0 0 0 0 0 0 0" if message == b"odometry" else b"sent 1 0 0")

        served = threading.Thread(target=serve)
        served.start()
        script = example("drive")
        monkeypatch.setattr(script, "time", clock)
        script.main(str(tmp_path / "base.sock"), 2, [(0.1, 0.0, 1.0), (0.0, -0.5, 0.5)])
        served.join()
    runs = " ".join(message for _, message in heard).split("odometry")
    assert len(runs) == 3 and not runs[2] and runs[0].split() == runs[1].split()
    assert runs[0].count("drive 0.1 0.0") == 20 and runs[0].count("drive 0.0 -0.5") == 10
    orders = [when for when, message in heard if message != "odometry"]
    assert max(b - a for a, b in pairwise(orders)) < 0.3 and orders[-1] == pytest.approx(2.95)
    assert capsys.readouterr().out.count("Motion(x_m=1.0") == 2


def test_each_example_says_how_it_is_run():
    for path in EXAMPLES.glob("*.py"):
        text = path.read_text()
        assert "__main__" in text, path.name
        assert path.name in text.partition('"""')[2].partition('"""')[0] or path.name == "light_sensor.py"
