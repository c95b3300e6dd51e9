"""`whisker doctor` on hosts with something wrong: what it finds and what it advises."""

import os
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from commandkit import STATS, live_ring, run, signals_as_before  # noqa: F401 - a fixture
from patience import PATIENCE_S
from rings import make_frames, ring_name

from crunchbot.bridge import doctor, pattern, usbtree
from crunchbot.bridge.ring import FRAME, FoundRing, Reader, Writer
from crunchbot.errors import UserError
from crunchbot.touch.calibration import measure_rest, read_noise, write_rest


@pytest.fixture
def host(tmp_path):
    """A host whose bridge is plugged in, allowed, and named by a rule."""
    device = tmp_path / "sys/bus/usb/devices/1-2"
    device.mkdir(parents=True)
    files = {"idVendor": "1209", "idProduct": "0001", "busnum": "1", "devnum": "7", "speed": "480", "serial": "B0042"}
    for name, content in files.items():
        (device / name).write_text(content + "\n")
    node = tmp_path / "dev/bus/usb/001/007"
    node.parent.mkdir(parents=True)
    node.write_bytes(b"")
    (tmp_path / "dev/shm").mkdir()
    rule = tmp_path / "etc/udev/rules.d/60-whisker.rules"
    rule.parent.mkdir(parents=True)
    rule.write_text('ATTR{idVendor}=="1209"\n')
    return tmp_path


def worst(findings):
    return [finding for finding in findings if finding.level == doctor.FAIL]


def test_the_calibration_is_read_as_it_was_written(tmp_path):
    rests = measure_rest(at_rest(2000))
    write_rest(tmp_path / "rest.toml", rests, ["a", "b", "c"])
    read = read_noise(tmp_path / "rest.toml")
    assert sorted(read) == [0, 1, 2] and all(read[r.lane] == pytest.approx(r.noise, abs=0.01) for r in rests)


def publish_until(stop, name):
    with Writer(name, 4096) as writer:
        writer.set_stats(**STATS)
        frames = make_frames(200)
        frames["lane_mask"] = 0b101
        while not stop.wait(0.01):
            frames["tick"] += 200
            frames["sequence"] += 200
            writer.publish(frames)


def test_bridges_are_found_by_the_numbers_that_are_set(host, monkeypatch):
    assert [bridge.serial for bridge in usbtree.bridges(host)] == ["B0042"]
    monkeypatch.setenv("WHISKER_USB_ID", "1d50:6000")
    assert usbtree.bridges(host) == []
    (host / "sys/bus/usb/devices/1-2/idVendor").write_text("1d50\n")
    (host / "sys/bus/usb/devices/1-2/idProduct").write_text("6000\n")
    assert [bridge.serial for bridge in usbtree.bridges(host)] == ["B0042"]
    for wrong in ("", "1209", "1209:00011", "0x12:0001"):
        monkeypatch.setenv("WHISKER_USB_ID", wrong)
        with pytest.raises(UserError, match="not VID:PID; give the numbers of the bridge, as 1209:0001"):
            usbtree.bridges(host)


def test_doctor_finds_nothing_where_all_is_well(host):
    name, stop = ring_name(), threading.Event()
    thread = threading.Thread(target=publish_until, args=(stop, name))
    thread.start()
    Reader(name, 10.0).close()
    findings = doctor.examine(name, host, look_s=0.1)
    stop.set()
    thread.join()
    lines = [finding.line() for finding in findings]
    assert worst(findings) == [] and any("none lost" in line for line in lines)
    assert any("60-whisker.rules" in line for line in lines) and any("bridge B0042" in line for line in lines)
    assert any("lane 2" in line and "CRC" in line and "cable" in line for line in lines)  # 1 % of its samples
    assert not any("lane 1:" in line for line in lines)  # not in the mask


@pytest.mark.parametrize(
    ("spoil", "text", "remedy"),
    [
        (lambda h: (h / "sys/bus/usb/devices/1-2/idVendor").write_text("dead\n"), "no bridge on the USB", "plug it in"),
        (lambda h: (h / "sys/bus/usb/devices/1-2/speed").write_text("12\n"), "runs at 12 Mbit/s", "USB 2.0"),
        (lambda h: (h / "dev/bus/usb/001/007").unlink(), "no device file", "container"),
        (lambda h: (h / "dev/shm").rmdir(), "dev/shm", "tmpfs"),
    ],
)
def test_doctor_names_what_is_wrong_with_the_cable(host, spoil, text, remedy):
    spoil(host)
    found = worst([*doctor.usb(host), *doctor.room(host / "dev/shm")])
    assert len(found) == 1 and text in found[0].text and remedy in found[0].remedy


@pytest.mark.parametrize(("free_mib", "fits"), [(1, False), (64, True)])  # the latter is what a container is given
def test_doctor_sees_whether_a_ring_fits_into_shared_memory(host, monkeypatch, free_mib, fits):
    monkeypatch.setattr("shutil.disk_usage", lambda path: SimpleNamespace(free=free_mib << 20))
    found = doctor.room(host / "dev/shm")
    assert found == [] if fits else "1 MiB free" in found[0].text and "remove old rings" in found[0].remedy
    assert worst(found) == found


def test_doctor_does_not_miss_a_cable_where_frames_arrive(host):
    (host / "sys/bus/usb/devices/1-2/idVendor").write_text("dead\n")
    name, stop = ring_name(), threading.Event()
    thread = threading.Thread(target=publish_until, args=(stop, name))
    thread.start()
    Reader(name, 10.0).close()
    findings = doctor.examine(name, host, look_s=0.1)
    stop.set()
    thread.join()
    assert worst(findings) == [] and any(f.level == doctor.WARN and "no bridge on" in f.text for f in findings)
    assert any("no bridge on" in f.text for f in worst(doctor.examine("whisker-none", host)))


def test_doctor_names_the_process_in_the_way(host):
    for pid, name in ((41, "whiskerd"), (42, "thief")):
        (host / f"proc/{pid}/fd").mkdir(parents=True)
        (host / f"proc/{pid}/comm").write_text(name + "\n")
        (host / f"proc/{pid}/fd/3").symlink_to(host / "dev/bus/usb/001/007")
    found = doctor.usb(host)
    assert [f.text for f in worst(found)] == ["process 42 (thief) holds the bridge"] and "kill 42" in worst(found)[
        0
    ].remedy
    assert any("whiskerd (process 41) holds" in f.text for f in found)


@pytest.mark.parametrize("masks", [(0b001, 0b101), (0b101, 0b001)])
def test_doctor_looks_at_the_lanes_that_are_in_use_now(masks):
    frames = make_frames(100)
    frames["lane_mask"] = np.repeat(masks, 50)
    frames["lane"]["status"] = 0
    frames["lane"]["status"][:, 2] = 33 << 10
    takes = iter([frames, None])
    reader = SimpleNamespace(seek_latest=lambda back: None, take=lambda wait_s: next(takes), stats=None)
    reported = any("lane 2:" in finding.text for finding in doctor.samples(reader, PATIENCE_S))
    assert reported == (masks[1] == 0b101)


def found_in(frames, monkeypatch, looked_s=0.5, noise=None):
    """What doctor says of these frames, taken in so long."""
    monkeypatch.setattr(doctor, "_watch", lambda reader, look_s: (frames, looked_s))
    return [finding.line() for finding in doctor.samples(SimpleNamespace(stats=None), 0.5, noise)]


def at_rest(count=1000):
    frames = make_frames(count)
    frames["lane"]["status"] = 0
    frames["lane_mask"] = 0b111
    return frames


def test_doctor_finds_a_lane_that_repeats_itself(monkeypatch):
    frames = at_rest()
    assert len(found_in(frames, monkeypatch)) == 1
    frames["lane"]["alpha"][:, 1] = 31337
    assert [line for line in found_in(frames, monkeypatch) if "lane" in line] == [
        "FAIL  lane 1: frozen: alpha one value in 1000 good samples; take the node's power away and give it back; "
        "else replace its sensor"
    ]
    frames["lane"]["beta"][:, 1] = 32700
    frames["lane"]["status"][:991, 1] = 33 << 10
    said = found_in(frames, monkeypatch)
    assert any("99.1 % bad" in line for line in said) and not any("frozen" in line for line in said)


def test_doctor_finds_a_lane_that_is_noisier_than_when_it_was_calibrated(monkeypatch):
    frames, noise = at_rest(), {lane: np.array([11.0, 11.0]) for lane in range(3)}
    assert len(found_in(frames, monkeypatch, noise=noise)) == 1
    frames["lane"]["beta"][:, 2] += (np.arange(1000) % 4000).astype(np.uint16)  # it moves: no noise
    assert len(found_in(frames, monkeypatch, noise=noise)) == 1
    frames["lane"]["beta"][:, 2] = np.random.default_rng(3).normal(0x8000, 33, 1000).round()
    (said,) = [line for line in found_in(frames, monkeypatch, noise=noise) if "lane" in line]
    assert said.startswith("warn  lane 2: noise 3") and "11.0 when it was calibrated" in said


def test_doctor_says_how_many_frames_are_due(monkeypatch):
    assert found_in(at_rest(), monkeypatch) == ["ok    1000 frames in 0.50 s, none lost"]
    (said,) = found_in(at_rest(332), monkeypatch)
    assert said.startswith("warn  332 frames in 0.50 s, none lost, where 1000 are due: the bridge runs at 0.33 of real")
    frames = np.delete(at_rest(1001), slice(500, 510))
    assert "991 frames in 0.50 s, 10 lost; check the USB cable" in found_in(frames, monkeypatch)[0]
    frames["dropped"][500:] = 10
    assert "991 frames in 0.50 s, 10 lost; end what keeps" in found_in(frames, monkeypatch)[0]


def test_doctor_says_how_old_the_newest_frame_is(host):
    with live_ring(make_frames(10)) as name:
        (found,) = [f for f in worst(doctor.stream(name, 0.01)) if "no frame" in f.text]
    age_s = float(found.text.removeprefix("no frame in 0.01 s, the newest is ").removesuffix(" s old"))
    assert abs(age_s - (time.monotonic() - 1.0)) < PATIENCE_S  # live_ring's clock began 1 s after the machine's


@pytest.mark.parametrize("text", ["", "lane = 3", "[[lane]]\nlane = 1\nnoise = [1.0]", "[[lane]]\nlane = 1", "no"])
def test_a_calibration_that_is_none_is_one_line(capsys, tmp_path, text):
    path = tmp_path / "rest.toml"
    path.write_text(text)
    code, _, err = run(capsys, "doctor", "--rest", path)
    assert code == 2 and err.count("\n") == 1 and str(path) in err and "that whisker calibrate wrote" in err


def test_doctor_asks_for_permission_and_rule(host, monkeypatch):
    monkeypatch.setattr("os.access", lambda *_: False)
    (host / "etc/udev/rules.d/60-whisker.rules").write_text("other\n")
    assert "permission denied" in worst(doctor.usb(host))[0].text
    assert doctor.rules(host)[0].level == doctor.WARN and "60" not in doctor.rules(host)[0].text


def test_doctor_reads_the_daemons_mind(host):
    with live_ring(make_frames(10), connected=0, error=-40) as name:
        found = worst(doctor.stream(name, 0.01))
        assert "no bridge is connected; plug it in" in found[0].text and "no frame" in found[1].text
    with live_ring(make_frames(10), wire_version=9, records_crc=3, reconnects=1) as name, Reader(name) as reader:
        lines = [finding.line() for finding in doctor.daemon(reader.stats)]
        assert any("wire version 9" in line and "one release" in line for line in lines)
        assert any("3 samples damaged" in line for line in lines) and any("1 times" in line for line in lines)
    assert "start whiskerd" in worst(doctor.stream("whisker-none", 0.01))[0].text


def test_doctor_finds_rings_left_behind(tmp_path):
    name = ring_name()
    program = f"import os; from crunchbot.bridge.ring import Writer; w = Writer('{name}', 64); os._exit(0)"
    subprocess.run([sys.executable, "-c", program], check=True, timeout=PATIENCE_S)
    try:
        found = doctor.stale_rings("whisker")
        assert any(f"ring {name} of user " in f.text and f.remedy == f"remove it: rm /dev/shm/{name}" for f in found)
        assert "died" in worst(doctor.stream(name, 0.01))[0].text
    finally:
        os.unlink(f"/dev/shm/{name}")


def test_doctor_names_whose_ring_was_left_behind(monkeypatch):
    left = [FoundRing("whisker", "/dev/shm/whisker", owner, "WRITER_DEAD") for owner in ("4242", "root")]
    monkeypatch.setattr(doctor, "found_rings", lambda: left)
    monkeypatch.setattr(os, "geteuid", lambda: 4242)
    (found,) = doctor.stale_rings("whisker")  # its own whiskerd replaces the first
    assert "of user root" in found.text and found.remedy == "remove it: sudo rm /dev/shm/whisker"


def test_doctor_exits_with_what_it_found(capsys):
    code, out, _ = run(capsys, "doctor", "--ring", "whisker-none")
    assert code == 1 and "FAIL  ring whisker-none" in out


def pattern_frames(count, mask=(1 << 28) - 1):
    frames = np.zeros(count, FRAME)
    frames["tick"] = np.arange(250, 250 + count)
    frames["sequence"] = np.arange(count) + (1 << 32) - 3
    frames["lane_mask"] = mask
    for lane in range(28):
        frames["lane"]["alpha"][:, lane] = 0x8000 + 256 * lane + 255 - frames["tick"] % 256
        frames["lane"]["beta"][:, lane] = 0x4000 + 256 * lane + frames["tick"] % 256
    return frames


def test_the_pattern_is_compared_sample_by_sample():
    frames = pattern_frames(20)
    assert pattern.wrong(frames) == []
    frames["lane"]["beta"][7, 3] ^= 0x100
    frames["lane"]["alpha"][8, 3] ^= 1
    frames["lane"]["status"][0, 27] = 32 << 10
    frames["sequence"][11:] += 2
    wanted = ["lane 3: 2 of 20 samples are not the pattern", "lane 27: 1 of 20 samples are not the pattern"]
    assert pattern.wrong(frames) == [*wanted, "2 frames were lost"]
    frames["lane_mask"] = 0x7
    assert pattern.wrong(frames) == ["2 frames were lost"]


def test_a_bridge_that_cannot_be_asked_is_reported_in_one_line(tmp_path):
    whiskerd = tmp_path / "whiskerd"
    whiskerd.write_text("#!/bin/sh\necho 'whiskerd: bridge: another process uses the bridge; stop it' >&2\nexit 1\n")
    whiskerd.chmod(0o755)
    (finding,) = doctor.prove(str(whiskerd))
    assert finding.level == doctor.FAIL and "another process uses the bridge" in finding.text and finding.remedy
