"""`whisker stream`: prints frames as they come."""

import argparse
import json
import sys
import threading
from collections.abc import Iterator

import numpy as np

from whisker_protocol import LANES, LIMITS

from ..arguments import add_ring, lane_list, whole_number
from ..bridge.ring import Reader, await_reader
from ..stopping import stop_on_signals

EXAMPLE = "whisker stream --lanes 0-5 --every 20 --frames 100 > drive.csv"
FIELDS = ("alpha", "beta", "status")
STOP_S = 0.5  # how soon a signal is noticed when no frames come


def add(parser: argparse.ArgumentParser) -> None:
    add_ring(parser)
    text = "such as 0,2,5-7 (default: the lane mask)"
    parser.add_argument("--lanes", type=lane_list(LANES), metavar="LIST", help=text)
    text = "print one frame in N, those whose tick is a multiple of N (not filtered: what is faster folds down)"
    parser.add_argument("--every", type=whole_number(1), default=1, metavar="N", help=text)
    parser.add_argument("--frames", type=whole_number(1), metavar="N", help="stop after so many")
    parser.add_argument(
        "--backlog", action="store_true", help="begin with the oldest frame the ring holds, not the next"
    )
    parser.add_argument("--json", action="store_true", help="JSON lines instead of CSV")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    stop = stop_on_signals()
    left = arguments.frames
    with await_reader(arguments.ring, arguments.wait, stop, arguments.ring_owner) as reader:
        if not arguments.backlog:
            reader.seek_latest(0)
        lanes, header = arguments.lanes, not arguments.json
        for frames in batches(reader, stop):
            if lanes is None:
                lanes = [n for n in range(LANES) if int(frames["lane_mask"][0]) >> n & 1]
            if header:
                print(",".join(["tick", "t_s", "sequence", *(f"lane{n}_{f}" for n in lanes for f in FIELDS)]))
                header = False
            chosen = frames[frames["tick"] % arguments.every == 0][:left]
            sys.stdout.writelines(json_lines(chosen, lanes) if arguments.json else csv_lines(chosen, lanes))
            sys.stdout.flush()
            left = None if left is None else left - len(chosen)
            if left == 0:
                break
    return 0


def batches(reader: Reader, stop: threading.Event) -> Iterator[np.ndarray]:
    """Copies of all new frames, until the ring is closed or `stop` is set; RingError when frames were lost."""
    while not stop.is_set():
        frames = reader.take(STOP_S)
        if frames is None:
            return
        if len(frames):
            yield frames


def csv_lines(frames: np.ndarray, lanes: list[int]) -> Iterator[str]:
    """A line per frame: tick, seconds of the bridge's clock, sequence number, then alpha, beta, status by lane."""
    table = np.stack([frames["lane"][field][:, lanes] for field in FIELDS], axis=2).reshape(
        len(frames), len(lanes) * len(FIELDS)
    )
    times = frames["time_cycles"] / LIMITS["clock_hz"]
    for tick, t_s, sequence, row in zip(frames["tick"], times, frames["sequence"], table.tolist(), strict=True):
        yield f"{tick},{t_s:.7f},{sequence},{','.join(map(str, row))}\n"


def json_lines(frames: np.ndarray, lanes: list[int]) -> Iterator[str]:
    """An object per frame; "lanes": {"2": [alpha, beta, status], ...}."""
    for frame in frames:
        samples = {str(n): [int(frame["lane"][field][n]) for field in FIELDS] for n in lanes}
        head = {"tick": int(frame["tick"]), "t_s": round(int(frame["time_cycles"]) / LIMITS["clock_hz"], 7)}
        yield json.dumps(head | {"sequence": int(frame["sequence"]), "lanes": samples}) + "\n"
