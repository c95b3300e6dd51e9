"""Clients at the socket of a base that speaks ROS 2: who commands, who finds a place, what is said to nonsense."""

import socket

import pytest

from crunchbot.base_table import BaseTable
from crunchbot.pilot.base import BUMP_LEFT, IDLE
from crunchbot.robot.rosbase.clients import CLIENTS_MOST, Clients
from crunchbot.robot.rosbase.drive import Drive
from crunchbot.robot.rosbase.listening import SocketError, listening

FOR_EVER = float("inf")
STEP = {"distance": 0.25, "scale_distance": 0.01}


class Driver:
    """Served by the test itself, whenever it asks."""

    def __init__(self, path, refusal: str = ""):
        self.path, self._listening = str(path), socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._listening.bind(self.path)
        self._listening.listen(2 * CLIENTS_MOST)
        self.drive = Drive(BaseTable(0.25, 0.5), lambda v, omega: True, lambda line: None)
        self.drive.lease_s = self.drive.heard_s = FOR_EVER
        self.drive.is_heard = True
        self.clients = Clients(self._listening, self.drive, lambda: 0, lambda: {"model": "ros2"}, refusal)

    def connect(self) -> socket.socket:
        made = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        made.settimeout(10.0)
        made.connect(self.path)
        self.clients.serve(0.0)
        return made

    def ask(self, client: socket.socket, text: str) -> str:
        client.send(text.encode())
        for _ in range(3):
            self.clients.serve(0.0)
        return client.recv(4096).decode()


@pytest.fixture
def driver(tmp_path):
    return Driver(tmp_path / "base.sock")


def test_a_commander_that_goes_leaves_standing_wheels(driver):
    client = driver.connect()
    assert driver.ask(client, "drive 0.2 0.1") == "sent 1 0.2 0.1" and driver.drive.driving
    client.close()
    driver.clients.serve(0.0)
    assert not driver.drive.driving and not driver.clients.commanded()


def test_an_observer_that_goes_stops_nothing(driver):
    client, other = driver.connect(), driver.connect()
    driver.ask(client, "drive 0.2 0.1")
    other.close()
    driver.clients.serve(0.0)
    assert driver.drive.driving


def test_each_has_its_own_odometry(driver):
    first = driver.connect()
    driver.clients.add(STEP)
    second = driver.connect()
    driver.clients.add(STEP)
    driver.clients.note(BUMP_LEFT)
    x, *_, bits = driver.ask(first, "odometry").split()[1:]
    assert (float(x), int(bits)) == (0.5, BUMP_LEFT)
    assert float(driver.ask(second, "odometry").split()[1]) == 0.25
    driver.drive.lease_s = 0.0
    assert driver.ask(first, "odometry").split()[-1] == str(IDLE)


@pytest.mark.parametrize(
    ("message", "answer"),
    [
        ("drive", "error say: drive V OMEGA, in m/s and rad/s"),
        ("drive nan 0", "error say: drive V OMEGA, in m/s and rad/s"),
        ("drive 1 2 3", "error say: drive V OMEGA, in m/s and rad/s"),
        ("mode fast", "error say: mode passive, mode safe or mode full"),
        ("odometry after 3", "error after N is of a Create's serial line; leave it out"),
        ("\udcff", "error say: drive V OMEGA, stop, mode NAME, odometry or health"),
        ("x" * 300, "error a message has at most 255 letters"),
    ],
)
def test_nonsense_is_answered_and_moves_nothing(driver, message, answer):
    client = driver.connect()
    client.send(message.encode(errors="surrogateescape"))
    driver.clients.serve(0.0)
    assert client.recv(4096).decode() == answer and not driver.drive.driving


def test_one_that_says_nothing_but_nonsense_loses_its_place(driver):
    clients = [driver.connect() for _ in range(CLIENTS_MOST)]
    driver.ask(clients[7], "nonsense")
    driver.ask(clients[8], "health")
    new = driver.connect()
    assert driver.ask(new, "health").startswith("health commander=0 model=ros2")
    assert clients[7].recv(4096) == b""
    assert driver.ask(clients[8], "health").startswith("health")


def test_where_all_have_come_just_now_nobody_loses_a_place(driver):
    clients = [driver.connect() for _ in range(CLIENTS_MOST)]
    for client in clients:
        driver.ask(client, "health")
    driver.ask(clients[0], "drive 0.1 0")
    driver.clients._all[0].heard_s -= 9.0  # the commander keeps its place
    new = driver.connect()
    assert new.recv(4096) == f"error {CLIENTS_MOST} clients are connected; end one of them first".encode()
    driver.clients._all[3].heard_s -= 1.0  # it has been silent for a second
    assert driver.ask(driver.connect(), "health").startswith("health")


def test_nobody_drives_a_base_that_is_not_to_be_driven(tmp_path):
    driver = Driver(tmp_path / "base.sock", "nobody has seen it stop; look")
    client = driver.connect()
    assert driver.ask(client, "drive 0.2 0") == "error nobody has seen it stop; look" and not driver.drive.driving
    assert driver.ask(client, "stop").startswith("sent 0")


def test_nothing_at_its_path_is_removed_but_what_is_its_own_or_left(tmp_path):
    path = tmp_path / "base.sock"
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as full:
        full.bind(str(path))
        full.listen(0)
        waiting = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        waiting.connect(str(path))  # nobody takes it: there is no place for another
        with pytest.raises(SocketError), listening(path):
            raise AssertionError("it is taken from one that lives")
        waiting.close()
    with listening(path):
        path.unlink()
        path.write_text("a person's")
    assert path.read_text() == "a person's"
    path.unlink()
    with listening(path):
        assert path.is_socket()
    assert list(tmp_path.iterdir()) == []
