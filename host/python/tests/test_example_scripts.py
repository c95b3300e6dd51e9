"""The examples as a user runs them, on the data set that `whisker examples` unpacks."""

import importlib.util
import subprocess
import sys
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


def test_each_example_says_how_it_is_run():
    for path in EXAMPLES.glob("*.py"):
        text = path.read_text()
        assert "__main__" in text, path.name
        assert path.name in text.partition('"""')[2].partition('"""')[0] or path.name == "light_sensor.py"
