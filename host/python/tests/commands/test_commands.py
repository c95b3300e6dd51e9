"""The commands that watch a ring: info, top, stream, record and replay; in a terminal where they have one."""

import argparse
import contextlib
import json
import os
import pty
import re
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from commandkit import command, live_ring, run, signals_as_before  # noqa: F401 - a fixture
from patience import PATIENCE_S
from rings import make_frames, ring_name

from crunchbot import __version__
from crunchbot.bridge.flow import Flow
from crunchbot.bridge.ring import Clock, Writer
from crunchbot.cli import COMMANDS, PARTS, main, parser_of
from crunchbot.commands import info
from crunchbot.commands.top import BARS, sparkline
from crunchbot.recording import read
from crunchbot.recording.writing import RecordingWriter
from crunchbot_lab.commands import bridge_sim
from whisker_protocol import CODES, LIMITS, STATUS_CODE_SHIFT, WIRE_VERSION


def test_help_names_every_command_and_imports_none(capsys):
    code, out, _ = run(capsys, "--help")
    assert code == 0 and all((f"\n  {name} " in out) == (name not in PARTS) for name in COMMANDS)
    program = "import sys; from crunchbot.cli import main; main(['--help']); print(sorted(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=PATIENCE_S)
    assert "numpy" not in done.stdout and "cffi" not in done.stdout and "argparse" in done.stdout


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_an_example(capsys, name):
    code, out, _ = run(capsys, name, "--help")
    assert code == 0 and f"example:\n  whisker {name}" in out


@pytest.mark.parametrize("name", ["info", "top", "stream", "record"])
def test_a_missing_ring_is_one_line(capsys, tmp_path, name):
    arguments = [tmp_path / "a.mcap"] if name == "record" else []
    code, out, err = run(capsys, name, *arguments, "--ring", "whisker-none")
    assert (
        code == 1
        and out == ""
        and err == "whisker: ring whisker-none: there is no ring of this name; start whiskerd with this --ring\n"
    )
    assert not (tmp_path / "a.mcap").exists()


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["stream", "--lanes", "0,28"], "'28' is no lane"),
        (["stream", "--every", "0"], "'0' is not a whole number of 1 or more"),
        (["stream", "--frames", "0"], "'0' is not a whole number of 1 or more"),
        (["replay", "x.mcap", "--speed", "fast"], "'fast' is not a number above 0, nor max"),
        (["replay", "x.mcap", "--ring-frames", "63"], "from 64 to"),
        (["replay", "x.mcap", "--ring-frames", "1000"], "'1000' is no power of two; give 512 or 1024"),
        (["replay", "x.mcap"], "x.mcap: cannot be read"),
        (["record"], "FILE.MCAP"),
        (["record", "x.mcap", "--seconds", "nan"], "'nan' is not a number above 0"),
        (["top", "--wait", "-1"], "'-1' is not a number of seconds"),
        (["bridge-sim", "--ring", "x", "--scene", "/nowhere"], "/nowhere: no such folder"),
        (["nonsense"], "invalid choice"),
    ],
)
def test_wrong_arguments_are_one_line(capsys, arguments, complaint):
    code, _, err = run(capsys, *arguments)
    assert code == 2 and complaint in err and err.count("\n") == 1


@pytest.mark.parametrize(("lanes", "mask"), [(6, 0x3F), (8, 0xFF), (28, 0xFFFFFFF)])
def test_the_simulated_bridge_and_its_daemon_have_the_same_lanes(monkeypatch, tmp_path, lanes, mask):
    monkeypatch.setattr(bridge_sim, "program", lambda name: name)
    arguments = parser_of("bridge-sim").parse_args(["bridge-sim", "--lanes", str(lanes)])
    words, _ = bridge_sim._command(arguments, tmp_path, threading.Event())
    reported = {name: words[words.index(name) + 1] for name in ("--lanes-populated", "--lane-mask")}
    assert reported == {"--lanes-populated": str(lanes), "--lane-mask": str(mask)}


def test_info_reports_ring_daemon_and_clock(capsys):
    with live_ring(make_frames(300)) as name:
        code, out, _ = run(capsys, "info", "--ring", name, "--json")
        reported = json.loads(out)
        assert code == 0 and reported["ring"]["published"] == 300 and reported["ring"]["writer_pid"] == os.getpid()
        assert reported["daemon"]["serial"] == "B0042" and reported["daemon"]["lanes"] == [0, 2]
        assert reported["clock"]["uncertainty_ns"] == 5000.0 and reported["host"]["wire_version"] == WIRE_VERSION
        assert reported["host"]["version"] == __version__ and reported["advice"] == []
        said = run(capsys, "info", "--ring", name)[1].splitlines()
        assert said[1].startswith(f"ring {name}: 300 frames written by process {os.getpid()} of ")
        assert (
            said[2].startswith("bridge B0042: connected (12 Mbit/s, gateware ")
            and "lanes 0, 2; no frames lost, " in said[2]
        )
        assert len(said) == 3, "one or two sentences, and what is plugged in"


@pytest.mark.parametrize(
    ("frames", "look_s", "looks", "answered"),
    [(100, 9.0, 5, True), (4000, 0.05, 99, False), (0, 3.0, 99, False)],
    ids=["a world slower than life", "frames, and no answer", "no frames"],
)
def test_the_nodes_answer_is_waited_for_by_the_bridges_own_time(monkeypatch, capsys, frames, look_s, looks, answered):
    seen = []
    with Writer(ring_name(), 4096) as writer:

        def look(_: str) -> tuple[str, int] | None:
            seen.append(len(seen))
            writer.publish(make_frames(frames, first=seen[-1] * frames))
            return ("lane 0", 1) if len(seen) == looks else None

        clock = SimpleNamespace(monotonic=lambda: look_s * len(seen), sleep=lambda _: None)
        monkeypatch.setattr(info, "time", clock)
        monkeypatch.setattr(info, "read_nodes", look)
        assert info.print_answer(writer.name, None) is answered
    out, err = capsys.readouterr()
    assert (out, "has not answered within 10 s" in err) == ("lane 0" * answered, not answered)


def test_info_names_versions_and_what_does_not_fit():
    bridge = {"wire_version": WIRE_VERSION, "gateware": LIMITS["gateware_version"]}

    def advised(daemon: dict, usb: list) -> str:
        return "\n".join(info.advice({"daemon": bridge | daemon, "usb": usb}))

    assert advised({}, []) == ""
    assert "install gateware and host of one release" in advised({"wire_version": WIRE_VERSION + 1}, [])
    assert "whisker flash BOARD.wgw" in advised({"gateware": LIMITS["gateware_version"] - 1}, [])
    assert "install a newer crunchbot" in advised({"gateware": LIMITS["gateware_version"] + 1}, [])
    assert "1209:0001 is for private tests only; do not give it to others" in advised({}, [{}])


def test_info_warns_of_no_id_of_ones_own(monkeypatch):
    monkeypatch.setenv("WHISKER_USB_ID", "1d50:6000")
    assert info.advice({"usb": [{}]}) == []


def test_stream_prints_chosen_lanes_and_ticks(capsys):
    frames = make_frames(100)
    with live_ring(frames) as name:
        options = ["--ring", name, "--backlog", "--every", 10, "--frames", 4]
        code, out, _ = run(capsys, "stream", *options, "--lanes", "2-3,5")
        lines = out.splitlines()
        assert code == 0 and len(lines) == 5
        assert lines[0].startswith("tick,t_s,sequence,lane2_alpha,lane2_beta,lane2_status,lane3_alpha")
        sample = frames["lane"][30, 5]
        assert lines[4].split(",")[:3] == ["30", "0.0150000", "37"]
        assert lines[4].split(",")[-3:] == [str(sample[field]) for field in ("alpha", "beta", "status")]
        reported = [json.loads(line) for line in run(capsys, "stream", *options, "--json")[1].splitlines()]
        assert [t["tick"] for t in reported] == [0, 10, 20, 30] and reported[3]["lanes"]["5"][0] == sample["alpha"]
        assert len(reported[0]["lanes"]) == 28


def test_stream_ends_quietly_with_its_reader():
    with live_ring(make_frames(4000)) as name:
        words = command("stream", "--ring", name, "--backlog", "--frames", 4000)
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            process.stdout.readline()
            process.stdout.close()
            assert process.stderr.read() == b"" and process.wait(PATIENCE_S) == 0


def test_record_and_replay_from_the_command_line(capsys, tmp_path):
    frames = make_frames(1500)
    first, second = tmp_path / "a.mcap", tmp_path / "b.mcap"
    with live_ring(frames) as name:
        code, out, _ = run(capsys, "record", first, "--ring", name, "--seconds", 0.6)
        assert code == 0 and f"{first}: 1200 frames, 0 lost, " in out
    recorder = threading.Thread(target=main, args=(["record", str(second), "--ring", name, "--wait", str(PATIENCE_S)],))
    recorder.start()
    assert run(capsys, "replay", first, "--ring", name, "--speed", "max")[0] == 0
    recorder.join()
    with read(second) as recording:
        assert np.array_equal(np.concatenate(list(recording.blocks())), frames[:1200])
    with read(first) as recording:
        assert recording.metadata["serial"] == "B0042" and recording.metadata["ring"] == name


def test_lanes_without_a_node_are_no_bad_samples(capsys, tmp_path):
    frames = make_frames(1000)
    frames["lane"]["status"][:, 6:] = 32 << 10
    with live_ring(frames) as name:
        out = run(capsys, "record", tmp_path / "a.mcap", "--ring", name, "--frames", 1000)[1]
    bad = np.count_nonzero(frames["lane"]["status"][:, :6])
    assert f"1000 frames, 0 lost, {bad} bad samples; 22 lanes without a good one" in out
    frames["lane"]["status"][:, 6:] = CODES["lane_off"] << STATUS_CODE_SHIFT
    with live_ring(frames) as name:
        out = run(capsys, "record", tmp_path / "b.mcap", "--ring", name, "--frames", 1000)[1]
    assert out.endswith(f"1000 frames, 0 lost, {bad} bad samples\n")


def test_a_file_has_one_recorder(capsys, tmp_path):
    path = tmp_path / "a.mcap"
    (tmp_path / "link").symlink_to(tmp_path)
    with live_ring(make_frames(1000)) as name:
        with RecordingWriter(path, {}):
            for same in (path, tmp_path / "link" / "a.mcap"):
                code, _, err = run(capsys, "record", same, "--ring", name, "--frames", 9, "--overwrite")
                assert code == 2 and "is being recorded by another process; stop it" in err and err.count("\n") == 1
            assert run(capsys, "record", tmp_path / "b.mcap", "--ring", name, "--frames", 9)[0] == 0
        assert run(capsys, "record", path, "--ring", name, "--frames", 9, "--overwrite")[0] == 0


def test_a_simulated_bridge_is_beside_none_on_the_usb(capsys, monkeypatch):
    monkeypatch.setattr(info.usbtree, "bridges", lambda: [])
    with live_ring(make_frames(10)) as name:
        out = run(capsys, "info", "--ring", name)[1]
    assert "usb: no bridge is plugged in; that of the ring is simulated, or in another container" in out
    with live_ring(make_frames(10), connected=0) as name:
        assert "usb: no bridge is plugged in\n" in run(capsys, "info", "--ring", name)[1]


def test_a_simulated_bridge_that_is_stopped_is_driven_to_its_end(monkeypatch):
    """A pilot that leaves before the simulation has been asked to end makes an error of it."""
    stop, seen, courses = threading.Event(), [], []
    stop.set()

    class Course:
        def __init__(self, over):
            self.over = over
            courses.append(self)

        def start(self):
            seen.append(self.over.is_set())

        def join(self):
            seen.append(self.over.is_set())

    class Process(subprocess.Popen):
        def send_signal(self, number):
            seen.append(courses[0].over.is_set())
            super().send_signal(number)

    monkeypatch.setattr(bridge_sim, "stop_on_signals", lambda: stop)
    monkeypatch.setattr(bridge_sim, "_command", lambda arguments, folder, over: (["sleep", "1000"], Course(over)))
    monkeypatch.setattr(bridge_sim.subprocess, "Popen", Process)
    assert main(["bridge-sim"]) == 0
    assert seen == [False, False, True]


def test_a_recorder_reported_to_stop_finishes_its_file(tmp_path):
    path = tmp_path / "a.mcap"
    words = ["record", path, "--ring"]
    with (
        live_ring(make_frames(1000)) as name,
        subprocess.Popen(command(*words, name), stdout=subprocess.PIPE) as process,
    ):
        while not path.exists() or path.stat().st_size < 20_000:
            assert process.poll() is None
        process.terminate()
        assert process.wait(PATIENCE_S) == 0
    with read(path) as recording:
        assert recording.complete and sum(map(len, recording.blocks())) == 1000


def test_replay_warns_of_a_damaged_recording(capsys, tmp_path):
    path = tmp_path / "a.mcap"
    with live_ring(make_frames(4000)) as name:
        assert run(capsys, "record", path, "--ring", name, "--frames", 4000)[0] == 0
    path.write_bytes(path.read_bytes()[:-50])
    code, out, err = run(capsys, "replay", path, "--ring", name, "--speed", "max", "--lead", 0)
    assert code == 0 and "4000 frames replayed" in out and "whisker: warning: " in err and err.count("\n") == 1
    path.write_bytes(path.read_bytes()[:1000] + bytes(4096) + path.read_bytes()[5096:])
    code, out, err = run(capsys, "replay", path, "--ring", name, "--speed", "max", "--lead", 0)
    assert "its checksum is wrong" in err or "cannot be unpacked" in err


def test_top_draws_in_a_terminal_and_leaves_it_as_it_was():
    with live_ring(make_frames(3000)) as name:
        ours, theirs = pty.openpty()
        environment = os.environ | {"COLUMNS": "100", "LINES": "40", "TERM": "xterm"}
        words = command("top", "--ring", name, "--interval", 0.1)
        with subprocess.Popen(words, stdin=theirs, stdout=theirs, stderr=theirs, env=environment) as process:
            os.close(theirs)
            seen = b""
            while seen.count(b"q quits") < 2:  # two pictures
                seen += os.read(ours, 65536)
            os.write(ours, b"q")
            with contextlib.suppress(OSError):  # the other end closes
                while data := os.read(ours, 65536):
                    seen += data
            assert process.wait(PATIENCE_S) == 0
        os.close(ours)
    text = seen.decode()
    assert text.startswith("\x1b[?1049h\x1b[?25l") and text.rstrip().endswith("\x1b[?25h\x1b[?1049l")
    assert (
        "0.0 frames/s" in text and "no frame for" in text and "27 lane27" in text and "bridge B0042 connected" in text
    )
    assert any(bar in text for bar in BARS)


def test_top_says_how_old_what_it_shows_is(capsys):
    """A writer that stands still gives no rate, and the traces are of then."""
    with Writer(ring_name()) as writer:
        frames = make_frames(2000)
        now = time.monotonic_ns() - 10 * 10**9  # the first frame's
        writer.set_clock(Clock(0, now, 0, 1e9 / LIMITS["clock_hz"], 1e3))
        writer.publish(frames)
        code, out, _ = run(capsys, "top", "--ring", writer.name, "--once", "--interval", 0.01)
    age_s = float(re.search(r"0\.0 frames/s, 0\.00 of real time, the newest (\S+) s ago\n", out)[1])
    assert code == 0 and 9.0 <= age_s < 9.0 + PATIENCE_S
    assert f"! no frame for {age_s} s: what is shown is how it was" in out
    rates = [float(line.split()[5]) for line in out.splitlines() if "lane1" in line]
    assert rates and set(rates) == {0.0}


def test_a_ring_says_what_share_is_lost_and_why():
    clock = SimpleNamespace(now=0.0)
    flow = Flow(lambda: clock.now)
    assert flow.rate() == 0.0 and flow.loss() is None
    flow.add(100, 50, 0)  # lost before
    for step in range(1, 11):
        clock.now = 0.1 * step
        flow.add(100 + 100 * step, 50 + 25 * step, 20 * step)
    share, why, remedy = flow.loss()
    assert (
        (share, flow.rate()) == (0.2, pytest.approx(1000.0)) and "the bridge dropped them" in why and "--pace" in remedy
    )
    flow.add(1200, 900, 200)
    assert "never came over the USB" in flow.loss()[1]
    for step in range(11, 35):
        clock.now = 0.1 * step
        flow.add(1200, 900, 200)
    assert flow.loss() is None and flow.rate() == 0.0
    flow.add(0, 0, 0)  # the writer was started again
    assert flow.loss() is None and flow.rate() == 0.0


def test_top_once_is_plain_text(capsys):
    frames = make_frames(1000)
    frames["lane_mask"] = 0b11
    frames["lane"]["status"][:, 0] = 32 << 10
    frames["lane"]["status"][:, 1] = np.arange(1000) % 4 == 0
    with live_ring(frames) as name:
        code, out, _ = run(capsys, "top", "--ring", name, "--once", "--interval", 0.01)
    assert code == 0 and "\x1b" not in out
    absent, live = (line for line in out.splitlines() if "lane0" in line or "lane1" in line)
    assert "nothing answers on this" in absent and "0.0 100.00" in absent
    assert float(live.split()[6]) == pytest.approx(25, abs=3)


def test_sparklines_show_what_moves():
    ramp = sparkline(np.linspace(30000, 31000, 800), 8)
    assert ramp == BARS
    assert len(set(sparkline(0x8000 + np.arange(100) % 3, 40))) == 1
    assert sparkline(np.array([5]), 40) in BARS and sparkline(np.empty(0), 40) == ""


def test_metadata_of_lane_names_is_checked(tmp_path):
    with pytest.raises(ValueError, match="lane names"):
        RecordingWriter(tmp_path / "a.mcap", {}, ["a,b"])
    assert not (tmp_path / "a.mcap").exists()


def options(parser):
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from options(inner)
        elif action.nargs != 0 and action.help != argparse.SUPPRESS:
            yield parser, action


@pytest.mark.parametrize("name", COMMANDS)
def test_arguments_are_shown_in_capitals_and_each_default_is_given_once(name):
    for parser, action in options(parser_of(name)):
        shown = " ".join(parser.format_help().split())
        first = action.metavar or (action.option_strings or [action.dest.upper()])[0]
        assert first.startswith("-") or first != first.lower(), (name, first)
        if action.option_strings and action.default not in (None, "", [], argparse.SUPPRESS):
            given = parser._get_formatter()._expand_help(action)
            assert given.count("default") == 1 and " ".join(given.split())[:40] in shown, (name, first, given)


def test_a_shell_completes_the_names_of_filters(capsys):
    with pytest.raises(SystemExit):
        parser_of().parse_args(["--print-completion", "bash"])
    assert re.search(r"localise___filter_choices=\(.*ekf", capsys.readouterr().out)
