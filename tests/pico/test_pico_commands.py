"""A user's commands on the executed Pico: from whiskers that sweep floors and meet a post, through firmware, USB and ring."""

import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from pico.readings import Log
from pico.stage import staged
from websockets.sync.client import connect

from crunchbot.bridge.ring import Reader
from crunchbot_lab.signals.recordings import radial_contacts, surface_drive
from crunchbot_lab.simulation.scenes import make_scene
from whisker_protocol import CODES, STATUS_CODE_SHIFT

LANES, WAIT_S, POLL_S = 6, 3600.0, 0.05  # a reader waits for frames, not for the clock
FLOOR, OBJECT = 0, 2  # lanes
SEED, FRAMES = 4, 2000
NOISE = 17.0  # counts of 0.1 mT at 60 mT
SPEED_M_S, SURFACES = 0.1, ("ROUGH", "SMOOTH")
# Of so many drives `train` says itself that 13 % of new windows may be unknown, and they may all lie in one drive.
DRIVES, NEW_DRIVES, DRIVE_FRAMES = 8, 3, 1000
STRAIGHT = ((1.0, 0.0, 60.0),)
MARK, MARKED = 0xC000, 0xA000  # counts of alpha: no floor bends a whisker so far
RADII_MM, REPEATS, WITHIN_MM = (90.0, 110.0, 130.0), 2, 10.0


@pytest.fixture(scope="module")
def scene() -> str:
    scene, start = make_scene(SEED, sensor="tmag5170")
    return scene.flat(start)


@pytest.fixture(scope="module")
def board(tmp_path_factory):
    """(field, ring, folder with the sensors' log); frames come."""
    folder, ring = tmp_path_factory.mktemp("pico"), f"whisker-test-pico-{os.getpid()}"
    with staged(folder, ring, LANES, NOISE) as field:
        with Reader(ring, WAIT_S) as reader:
            reader.take(WAIT_S)  # a whiskerd that has its ring is still connecting, and says nothing of itself
        yield field, ring, folder


def started(*words) -> subprocess.Popen:
    command = [sys.executable, "-u", "-m", "crunchbot.cli", *map(str, words)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def said(*words) -> str:
    """What a command prints; it must end well."""
    with started(*words) as process:
        out, err = process.communicate()
    assert process.returncode == 0, err
    return out


def felt(field, ring: str, counts: np.ndarray) -> None:
    """The lane of the floors feels these counts (n, 2) again and again; returns when the newest frame is of them.

    They run there and back, so that their repetition has no jump. A mark before them tells what is still of before.
    """
    with Reader(ring, WAIT_S) as reader:
        reader.seek_latest(0)
        for part, marked in ((np.full((1, 2), MARK), True), (np.concatenate([counts, counts[::-1]]), False)):
            field.play(FLOOR, part, forever=True)
            while (reader.take(WAIT_S)["lane"]["alpha"][-1, FLOOR] > MARKED) != marked:
                pass


def test_frames_are_what_the_sensors_showed(board):
    _, ring, folder = board
    with Reader(ring, WAIT_S) as reader:
        taken = []
        while sum(map(len, taken)) < FRAMES:
            taken.append(reader.take(WAIT_S))
    frames = np.concatenate(taken)
    codes = frames["lane"]["status"] >> STATUS_CODE_SHIFT
    assert set(np.unique(codes[-100:, :LANES])) == {CODES["ok"]}
    assert set(np.unique(codes[:, LANES:])) == {CODES["lane_off"]}
    assert set(np.unique(codes[:, :LANES])) <= {CODES["ok"], CODES["starting"]}
    lanes = frames["lane"]
    readings = np.stack([lanes["alpha"], lanes["beta"], lanes["status"]], axis=2).tolist()
    compared = Log(folder / "log").compare(zip(frames["tick"].tolist(), readings, strict=True), range(LANES))
    assert compared >= 0.9 * LANES * FRAMES


def test_info_says_the_real_speed_and_doctor_finds_nothing(board):
    _, ring, _ = board
    reported = json.loads(said("info", "--json", "--ring", ring, "--wait", WAIT_S))["daemon"]
    assert reported["lanes"] == list(range(LANES)) and reported["frames_damaged"] == 0
    assert (reported["serial"], reported["usb_mbit"]) == ("E6613852837F2B21", 12)
    assert "bridge E6613852837F2B21: connected (12 Mbit/s, " in said("info", "--ring", ring)
    assert said("info", "--nodes", "--ring", ring).startswith(f"{LANES} nodes answer\n")
    found = said("doctor", "--ring", ring)
    assert "frames in 0.50 s, none lost" in found and "lane " not in found


def test_the_page_shows_its_lanes(board):
    _, ring, _ = board
    with started("view", "--ring", ring, "--port", "0") as view:
        place = re.search(r"http://(\S+?)/", view.stdout.readline())[1]
        with connect(f"ws://{place}/ws") as socket:
            socket.send(json.dumps({"type": "subscribe", "topic": "status", "ring": ring}))
            count, status = 0, {}
            while status.get("state") != "live":
                message = socket.recv()
                count += 1
                status = json.loads(message) if isinstance(message, str) else {}
                socket.send(json.dumps({"type": "ack", "count": count}))
        view.terminate()
    assert status["lanes"]["state"][:LANES] == ["good"] * LANES and set(status["bad"]) == {"lane_off"}
    assert status["daemon"]["usb_mbit"] == 12


def test_textures_are_trained_on_its_recordings_and_recognised(board, scene, tmp_path):
    field, ring, _ = board

    part_s, drives, right = DRIVE_FRAMES / 2000, DRIVES + NEW_DRIVES, []
    drawn = {
        surface: next(iter(surface_drive(scene, surface, SPEED_M_S, drives * part_s, SEED, STRAIGHT).values()))
        for surface in SURFACES
    }

    def record(surface: str, part: int, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        felt(field, ring, drawn[surface][part * DRIVE_FRAMES :][:DRIVE_FRAMES])
        path.write_text(said("stream", "--ring", ring, "--lanes", FLOOR, "--frames", DRIVE_FRAMES))

    for surface in SURFACES:
        for part in range(DRIVES):
            record(surface, part, tmp_path / "recordings" / surface / f"{part}.csv")
    said("texture", "train", tmp_path / "recordings", "--out", tmp_path / "texture.json")
    for surface in SURFACES:
        for part in range(DRIVES, drives):
            new = tmp_path / f"{surface}{part}.csv"
            record(surface, part, new)
            lines = said("texture", "classify", "--json", tmp_path / "texture.json", new).splitlines()
            right += [json.loads(line)["label"] == surface for line in lines]
    assert np.mean(right) > 0.7, right


def test_contacts_are_calibrated_on_it_and_their_radii_estimated(board, scene, tmp_path):
    field, ring, _ = board
    contacts = radial_contacts(scene, "object_1", SEED, REPEATS, radii_mm=RADII_MM)
    radii = ",".join(f"{radius:g}" for radius in RADII_MM)
    rests = [np.tile(contact.counts[:100], (10, 1)) for contact in contacts]  # between two the plug comes back to rest
    field.play(OBJECT, rests[0], forever=True)
    words = ["--out", tmp_path / "cal", "--rest-seconds", "0.3", "--lane", OBJECT, "--radii", radii]
    with started("calibrate", "--ring", ring, "--yes", "--repeats", REPEATS, *words) as calibrate:
        while not (tmp_path / "cal/lane2.csv").exists() and calibrate.poll() is None:
            time.sleep(POLL_S)  # until it has measured rest
        field.play(
            OBJECT, np.concatenate([p for pair in zip(rests, contacts, strict=True) for p in (pair[0], pair[1].counts)])
        )
        field.play(OBJECT, rests[-1], forever=True)
        out, err = calibrate.communicate()
    assert calibrate.returncode == 0 and f"{len(contacts)} contacts, places left out" in out, err
    table = tmp_path / "cal/lane2.csv"
    said("radial", "fit", table, "--out", tmp_path / "radial.json")
    lines = said("radial", "predict", "--json", tmp_path / "radial.json", table).splitlines()
    found = [json.loads(line)["radius_mm"] for line in lines]
    assert found == pytest.approx([contact.radius_mm for contact in contacts], abs=WITHIN_MM)
