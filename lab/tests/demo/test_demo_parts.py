"""Parts of the demo that need no simulation: scene, summary, ring blocks, link, children."""

import os
import socket
import stat
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from crunchbot import scene as scenes
from crunchbot.bridge.ring import FRAME, Reader, RingError
from crunchbot.native import ffi, lib
from crunchbot.robot.blocks import blocks
from crunchbot.robot.simulation_link import SimLink
from crunchbot_lab.demo import summary
from crunchbot_lab.demo.__main__ import fresh_folder, guarded, parse
from crunchbot_lab.demo.chain import ChainError, ChainRun, SpiLink, _await_end, run_chain
from crunchbot_lab.simulation.bridge import flat_scene
from crunchbot_lab.simulation.scenes import BLOCKS, PRIOR_OFF_M, PRIOR_OFF_RAD, make_scene
from whisker_protocol import LIMITS


@pytest.mark.parametrize("seed", range(20))
def test_scene_is_the_papers_arena_with_a_wrong_prior(seed, tmp_path):
    scene, start = make_scene(seed)
    arena, robot = scene.arena, scene.robot
    assert set("".join(arena.floor)) == {"V", "S", "R"} and len(arena.floor) == 5
    assert len(set(arena.obstacles)) == BLOCKS
    assert arena.is_free(*start[:2], robot.body_radius_m)
    off = np.subtract(scene.prior.mean, start)
    assert np.hypot(*off[:2]) == pytest.approx(PRIOR_OFF_M) and abs(off[2]) == pytest.approx(PRIOR_OFF_RAD)
    scenes.write(tmp_path, scene)
    assert scenes.load(tmp_path) == scene


def test_object_whiskers_stand_perpendicular_to_their_arm():
    tips = []
    for whisker in make_scene(1)[0].robot.of_role("object"):
        along = np.array([np.cos(whisker.yaw_rad), np.sin(whisker.yaw_rad)])
        assert np.dot(whisker.base_m, along) == pytest.approx(0.0, abs=1e-12)
        assert np.hypot(*whisker.base_m) == pytest.approx(0.16)
        tip = whisker.base_m + whisker.length_m * along
        tips.append(np.degrees(np.arctan2(tip[1], tip[0])))
    assert tips == pytest.approx([60.0, 20.0, -20.0, -60.0])


def test_texture_accuracy_counts_read_moving_inside_windows():
    scene, _ = make_scene(1)

    def row(left, right):
        cells = {f"{n}_{t}": None for n in ("floor_left", "floor_right") for t in scene.arena.textures}
        for name, label in (("floor_left", left), ("floor_right", right)):
            if label:
                cells |= {f"{name}_{t}": float(t == label) for t in scene.arena.textures}
        return cells

    def true(moved, inside):
        return {f"{n}_{k}": v for n in ("floor_left", "floor_right") for k, v in
                (("moved_mm", moved), ("inside_mm", inside), ("tile", "VINYL"))}  # fmt: skip

    rows = [row("VINYL", "ROUGH"), row("VINYL", None), row("ROUGH", "VINYL"), row("ROUGH", "ROUGH")]
    truth = [true(10, 60), true(10, 60), true(10, 40), true(1, 60)]
    scores = summary.texture_scores(rows, truth, scene)
    assert scores == {
        "texture_accuracy": 2 / 3,
        "texture_accuracy_all": 3 / 5,
        "texture_windows_share": 3 / 4,
    }


def test_fault_sets_must_be_equal_pair_by_pair(tmp_path):
    (tmp_path / "faults.csv").write_text("lane,tick,kind\n1,5,flip\n1,5,resync\n2,9,dead\n")
    (tmp_path / "bad.csv").write_text("lane,tick,code,errors\n1,5,33,0\n2,8,33,0\n")
    scores = summary.fault_scores(tmp_path / "faults.csv", tmp_path / "bad.csv")
    assert scores == {"records_bad_injected": 2, "records_bad_reported": 2, "records_bad_match": False}


class MadeUpReader:
    def __init__(self, *ticks):
        self._ticks = ticks

    def frames(self):
        for ticks in self._ticks:
            frames = np.zeros(len(ticks), FRAME)
            frames["tick"] = ticks
            frames["lane"]["alpha"] = np.asarray(ticks)[:, None] % 1000
            yield frames


@pytest.mark.parametrize("cuts", [[100], [1, 39, 60], [40, 40, 20], [97, 3]])
def test_blocks_do_not_depend_on_how_frames_arrive(cuts):
    pieces = np.split(np.arange(100), np.cumsum(cuts)[:-1])
    made = list(blocks(MadeUpReader(*pieces), 6))
    assert [(first, len(samples)) for first, samples in made] == [(0, 40), (40, 40), (80, 20)]
    for first, samples in made:
        assert (samples["alpha"][:, 5] == np.arange(first, first + len(samples))).all()
        assert (samples["status"] == 0).all()


def test_lost_ticks_are_bad_samples():
    kept = np.delete(np.arange(160), np.r_[10:13, 75:122])
    made = dict(blocks(MadeUpReader(kept), 6))
    assert sorted(made) == [0, 40, 80, 120]
    bad = {first: np.flatnonzero(samples["status"][:, 0]).tolist() for first, samples in made.items()}
    assert bad == {0: [10, 11, 12], 40: list(range(35, 40)), 80: list(range(40)), 120: [0, 1]}


def test_reader_sees_frames_in_place_until_the_ring_is_closed():
    name = f"whisker-test-reader-{os.getpid()}"
    ring = ffi.new("struct whisker_ring **")
    assert lib.whisker_ring_create(name.encode(), 64, ring) == 0
    frames = np.zeros(10, FRAME)
    frames["tick"] = np.arange(10)
    frames["lane"]["beta"][:, 27] = 7
    with Reader(name) as reader:
        pointer = ffi.cast("struct whisker_frame *", frames.ctypes.data)
        assert lib.whisker_ring_publish(ring[0], pointer, len(frames)) == 0
        stream = reader.frames()
        seen = next(stream)
        assert seen["tick"].tolist() == list(range(10)) and (seen["lane"]["beta"][:, 27] == 7).all()
        assert not seen.flags.owndata
        lib.whisker_ring_close(ring[0])
        assert list(stream) == []
    with pytest.raises(RingError, match=f"ring {name}: .*; "):
        Reader(name)


def test_link_speaks_the_simulations_messages(tmp_path):
    path = str(tmp_path / "sim.sock")
    server = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    server.bind(path)
    server.listen()
    heard = []

    def simulate():
        client, _ = server.accept()
        heard.append(client.recv(256))
        client.send(b"odometry 199 0.5 0 -0.25")
        heard.append(client.recv(256))
        client.send(b"end 240")
        client.close()

    thread = threading.Thread(target=simulate)
    thread.start()
    with SimLink(path) as link:
        assert link.odometry(199) == (0.5, 0.0, -0.25)
        link.drive(239, 0.1, -1e-3)
        assert link.odometry(399) is None
        assert link.ended_after == 240
    thread.join()
    server.close()
    assert heard == [b"pilot", b"drive 239 0.1 -0.001"]


def test_link_without_simulation_says_what_to_do(tmp_path):
    with pytest.raises(OSError, match="start the simulated bridge first"):
        SimLink(str(tmp_path / "none.sock"))


def program(folder, name, text):
    path = folder / name
    path.write_text("#!/bin/sh\n" + text)
    path.chmod(path.stat().st_mode | stat.S_IXUSR)


def chain_of(tmp_path, bridge):
    build, out = tmp_path / "build", tmp_path / "out"
    build.mkdir()
    out.mkdir()
    program(build, "whisker-bridge-sim", bridge)
    program(build, "whiskerd", "exit 0\n")
    for name in ("whisker-log", "whisker-base"):
        program(build, name, "exec sleep 100\n")
    return ChainRun(out, build, 1, 1.0, 6, SpiLink(6, 30, 5))


def test_failing_child_is_one_line_with_its_log(tmp_path):
    run = chain_of(tmp_path, "echo progress 1 2 >&2; echo 'sim: no such scene; make one' >&2; exit 3\n")
    with pytest.raises(ChainError) as error:
        run_chain(run, lambda tick: None)
    assert str(error.value) == (
        f"bridge failed (exit code 3): sim: no such scene; make one; log: {tmp_path / 'out' / 'logs' / 'bridge.log'}"
    )


def test_no_child_outlives_a_failure(tmp_path):
    marker = f"4{os.getpid()}"
    # Makes the socket's file, leaves a grandchild in the background, then fails.
    bridge = f'while [ "$1" != --socket ]; do shift; done; : >"$2"; sleep {marker} & exit 5\n'
    with pytest.raises(ChainError):
        run_chain(chain_of(tmp_path, bridge), lambda tick: None)
    until = time.monotonic() + 5.0
    while (left := running_with(marker)) and time.monotonic() < until:
        pass
    assert left == []


def test_a_killed_whiskerds_ring_is_removed(tmp_path):
    kept = tmp_path / "ring"
    bridge = f"""while [ "$1" != --ring ]; do shift; done; : >"/dev/shm/$2"; echo "$2" >{kept}; exit 5\n"""
    with pytest.raises(ChainError):
        run_chain(chain_of(tmp_path, bridge), lambda tick: None)
    ring = Path("/dev/shm", kept.read_text().strip())
    left = ring.exists()
    ring.unlink(missing_ok=True)
    assert not left


def test_a_failure_of_who_ends_last_is_reported_too():
    """When all have ended before anybody looks."""

    def ended(failed):
        program = SimpleNamespace(serves=False)
        return SimpleNamespace(running=False, program=program, failed=failed, ended_s=1.0, failure=lambda: "bag failed")

    with pytest.raises(ChainError, match="bag failed"):
        _await_end([ended(False), ended(True)])
    _await_end([ended(False), ended(False)])


@pytest.mark.parametrize(
    ("raised", "code", "line"),
    [
        (None, 0, ""),
        (ChainError("bridge failed; see its log"), 1, "demo: bridge failed; see its log\n"),
        (scenes.SceneError("arena.toml: mend it"), 1, "demo: arena.toml: mend it\n"),
        (KeyboardInterrupt(), 130, "demo: interrupted\n"),
    ],
)
def test_what_ends_a_demo_is_one_line_and_an_exit_code(capsys, monkeypatch, raised, code, line):
    monkeypatch.setattr("crunchbot_lab.demo.__main__.interrupt_on_signals", lambda: None)

    def job(options):
        if raised:
            raise raised

    assert guarded("demo", job, parse([])) == code
    assert capsys.readouterr() == ("", line)


def test_the_nodes_link_is_set_by_options_and_else_the_fastest():
    def link(*words):
        options = parse(list(words))
        return options.sck_divider, options.word_gap, options.sample_point

    assert link("--sck-divider", "8", "--word-gap", "40", "--sample-point", "6") == (8, 40, 6)
    divider, gap, sample = link()
    assert (divider, gap) == (LIMITS["sck_divider_min"], LIMITS["word_gap_min"]) and 1 <= sample <= divider


def test_a_spread_of_no_seed_is_refused_in_one_line(capsys):
    with pytest.raises(SystemExit):
        parse(["--spread", "0"])
    assert "argument --spread: '0' is not a whole number of 1 or more" in capsys.readouterr().err


def running_with(word):
    """Processes whose command line holds `word`."""
    found = []
    for entry in os.listdir("/proc"):
        try:
            words = Path("/proc", entry, "cmdline").read_bytes().split(b"\0") if entry.isdigit() else []
        except OSError:
            continue
        if word.encode() in words:
            found.append(entry)
    return found


def test_foreign_folder_is_never_removed(tmp_path):
    (tmp_path / "precious.txt").write_text("keep")
    with pytest.raises(ChainError, match="choose another --out"):
        fresh_folder(tmp_path)
    assert (tmp_path / "precious.txt").exists()
    mine = fresh_folder(tmp_path / "new")
    (mine / "old.csv").write_text("")
    assert not (fresh_folder(mine) / "old.csv").exists()


def test_how_whiskers_bend_is_reported_to_the_world_and_is_no_part_of_the_folder(tmp_path):
    scene, start = make_scene(5, "modes")
    assert {"mechanics modes", "batch 5"} <= set(scene.flat(start).splitlines())
    scenes.write(tmp_path, scene)
    assert scenes.load(tmp_path) == scene
    text, _ = flat_scene(str(tmp_path), 7, "modes")
    assert {"mechanics modes", "batch 7"} <= set(text.splitlines())
    assert "mechanics static" in flat_scene(None, 7)[0]
