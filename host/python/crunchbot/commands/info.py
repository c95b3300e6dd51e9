"""`whisker info`: what the ring, the daemon and the bridge say of themselves."""

import argparse
import dataclasses
import json
import os
import shlex
import signal
import sys
import time

from whisker_protocol import LIMITS, WIRE_VERSION

from .. import __version__
from ..arguments import add_ring
from ..bridge import usbtree
from ..bridge.ring import Reader, RingError, read_nodes, signal_writer
from ..programs import program

EXAMPLE = "whisker info --json"
ANSWER_S = 10.0  # whiskerd asks its nodes within 200 ticks
# The same in the bridge's frames: a simulated bridge may be slower than real time.
ANSWER_TICKS = round(ANSWER_S * LIMITS["clock_hz"] / LIMITS["tick_period"])
TEST_ID_TEXT = "{:04x}:{:04x}".format(*usbtree.TEST_ID)


def add(parser: argparse.ArgumentParser) -> None:
    add_ring(parser)
    parser.add_argument("--json", action="store_true", help="all that is known, as one object on one line")
    parser.add_argument(
        "--nodes",
        action="store_true",
        help="who the nodes are, their versions, and what they counted; no sample is lost",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    if arguments.nodes:
        return ask_nodes(arguments.ring)
    host = {"version": __version__, "wire_version": WIRE_VERSION, "gateware": LIMITS["gateware_version"]}
    reported = {"host": host, "usb": [describe_usb(found) for found in usbtree.bridges()]}
    try:
        with Reader(arguments.ring, arguments.wait, arguments.ring_owner) as reader:
            reported |= describe_ring(reader)
    except RingError as error:
        if not reported["usb"] or error.name != "RING_MISSING":
            raise
        reported["ring"] = {"name": arguments.ring, "state": str(error)}
    reported["advice"] = advice(reported)
    print(json.dumps(reported) if arguments.json else "\n".join(spoken(reported)))
    return 0


def advice(reported: dict) -> list[str]:
    """What does not fit together, and what must not be given to others: a line each, with the remedy."""
    found, daemon = [], reported.get("daemon", {})
    host_wire, host_gateware = WIRE_VERSION, LIMITS["gateware_version"]
    wire, gateware = daemon.get("wire_version", 0), daemon.get("gateware", 0)
    if wire not in (0, host_wire):
        found.append(f"bridge: wire version {wire}, host: {host_wire}; install gateware and host of one release")
    elif 0 < gateware < host_gateware:
        text = "it works; for what is new: make bitstream BOARD=..., whisker flash BOARD.wgw"
        found.append(f"bridge: gateware {gateware}, this release: {host_gateware}; {text}")
    elif gateware > host_gateware:
        found.append(f"bridge: gateware {gateware}, this release: {host_gateware}; install a newer crunchbot")
    if reported["usb"] and usbtree.identity() == usbtree.TEST_ID:
        text = "do not give it to others; build it with USB_ID= (docs/boards.md, USB identity)"
        found.append(f"bridge: USB id {TEST_ID_TEXT} is for private tests only; {text}")
    return found


def ask_nodes(ring: str) -> int:
    """One process at a time has the bridge: a whiskerd that streams is the one to ask."""
    try:
        with Reader(ring) as reader:
            streaming, owner = bool(reader.stats and reader.stats.connected), reader.owner
    except RingError:
        streaming = False
    if not streaming:
        lister = program("whisker-flash")
        return os.spawnv(os.P_WAIT, lister, [lister, "--list", "--health"])
    before = read_nodes(ring)
    try:
        signal_writer(ring, signal.SIGUSR2)
    except RingError as error:
        if error.name != "RING_ACCESS":
            raise
        text = f"whiskerd of user {owner} has the bridge; run: sudo whisker info --nodes --ring {shlex.quote(ring)}"
        print(text, file=sys.stderr)
        return 1
    return 0 if print_answer(ring, before) else 1


def print_answer(ring: str, before: tuple[str, int] | None) -> bool:
    """Prints what whiskerd writes for its readers once it has asked the nodes. False: nothing came in time.

    The time is the bridge's, counted in frames, and the wall's while none come.
    """
    with Reader(ring) as reader:
        asked = seen = reader.info.published
        since = time.monotonic()
        while (answer := read_nodes(ring)) == before:
            published = reader.info.published
            if published != seen:
                seen, since = published, time.monotonic()
            if seen - asked > ANSWER_TICKS or time.monotonic() - since > ANSWER_S:
                text = f"info: whiskerd of ring {ring} has not answered within {ANSWER_S:g} s; look into its log"
                print(f"whisker: {text}", file=sys.stderr)
                return False
            time.sleep(0.05)
    print(answer[0], end="")
    return True


def describe_usb(bridge: usbtree.Bridge) -> dict:
    return {"node": str(bridge.node), "product": bridge.product, "serial": bridge.serial, "speed_mbit": bridge.speed}


def describe_ring(reader: Reader) -> dict:
    """What a reader of the ring can know: counters, daemon and bridge, clock."""
    reported: dict = {"ring": {"name": reader.name} | dataclasses.asdict(reader.info)}
    if stats := reader.stats:
        reported["daemon"] = dataclasses.asdict(stats) | {"lanes": [n for n in range(32) if stats.lane_mask >> n & 1]}
        reported["daemon"]["up_s"] = round(time.time() - stats.started_ns / 1e9, 1)
    if clock := reader.clock:
        reported["clock"] = dataclasses.asdict(clock)
    return reported


def _is_connected(reported: dict) -> bool:
    return bool(reported.get("daemon", {}).get("connected"))


def spoken(reported: dict) -> list[str]:
    """For a person: what is plugged in, whether samples come, who brings them; --json has the rest."""
    apart = "; that of the ring is simulated, or in another container" if _is_connected(reported) else ""
    out = [f"usb: bridge {usb['serial']}, {usb['product']}, at {usb['speed_mbit']} Mbit/s" for usb in reported["usb"]]
    out, ring, daemon = out or [f"usb: no bridge is plugged in{apart}"], reported["ring"], reported.get("daemon")
    if "state" in ring:
        return [*out, f"ring {ring['name']}: {ring['state']}", *reported["advice"]]
    out += [
        f"ring {ring['name']}: {ring['published']} frames written by process {ring['writer_pid']} of {ring['owner']}"
    ]
    if daemon:
        bad = sum(daemon[f"records_{kind}"] for kind in ("crc", "tick", "usb", "sensor"))
        lanes = ", ".join(map(str, daemon["lanes"])) or "none"
        lost = f"{daemon['frames_missing'] or 'no'} frames lost, {bad or 'no'} records bad"
        speed = f"{daemon['usb_mbit']} Mbit/s, " if daemon["usb_mbit"] else ""
        known = f"{speed}gateware {daemon['gateware']}, wire version {daemon['wire_version']}"
        state = f"connected ({known}), lanes {lanes}" if daemon["connected"] else "not connected"
        out += [f"bridge {daemon['serial'] or 'without a serial number'}: {state}; {lost} in {daemon['up_s']:.0f} s"]
    return out + reported["advice"]
