"""`whisker calibrate`: rest of every lane, and contacts at known distances for `whisker radial fit`."""

import argparse
import itertools
import sys
from contextlib import closing
from pathlib import Path

import numpy as np

from whisker_protocol import LANES

from ..arguments import add_output, add_ring, number_above, number_list, warn, whole_number
from ..bridge.nodes import NodeError, read_nodes
from ..bridge.ring import Reader
from ..outputs import claim, made, unwritable
from ..scene import load
from ..touch.calibration import (
    TICKS_PER_S,
    ContactsFile,
    Feed,
    Rest,
    Whisk,
    WhiskFinder,
    collect,
    measure_rest,
    write_rest,
)
from ..touch.radial.model import Contact, fit, read_whisks
from ..touch.radial.push import ONSET_SHARE, press_of, reach_of

REST = "rest.toml"
EXAMPLE = "whisker calibrate --out calibration"


def add(parser: argparse.ArgumentParser) -> None:
    add_ring(parser)
    text = "writes rest.toml where there is none, and <lane>.csv with --lane"
    add_output(parser, "--out", own=None, required=True, type=Path, metavar="DIR", help=text)
    parser.add_argument(
        "--lane", type=whole_number(0, LANES - 1), metavar="N", help="the whisker to press against the post"
    )
    parser.add_argument(
        "--radii", type=number_list, metavar="LIST", help="distances of the post in mm, as in 90,100,110"
    )
    parser.add_argument("--repeats", type=whole_number(1), default=5, metavar="N", help="whisks at each distance")
    parser.add_argument(
        "--rest-seconds", type=number_above(0.2), default=2.0, metavar="S", help="how long rest is measured"
    )
    parser.add_argument(
        "--whisk-rad-s", type=number_above(0.0), metavar="W", help="turning rate of the whisks, if known"
    )
    text = "what 'whisker info --nodes' printed: the model then belongs to this lane's node, and is refused for others"
    parser.add_argument("--nodes", metavar="FILE", help=text)
    parser.add_argument("--scene", metavar="SCENE", help="scene folder whose robot.toml names the lanes, lane 0 first")
    parser.add_argument("--yes", action="store_true", help="ask nothing: whisks at the distances follow one another")
    parser.add_argument(
        "--backlog", action="store_true", help="begin with the oldest frame the ring holds, not the next"
    )
    parser.set_defaults(run=run, parser=parser)


def run(arguments: argparse.Namespace) -> int:
    if (arguments.lane is None) != (arguments.radii is None):
        arguments.parser.error("--lane and --radii belong together: give both, or neither to measure rest alone")
    names = [whisker.name for whisker in load(arguments.scene).robot.whiskers] if arguments.scene else []
    names += [f"lane{n}" for n in range(len(names), LANES)]
    node = _node(arguments)
    name = REST if arguments.lane is None else f"{names[arguments.lane]}.csv"
    claim(arguments.out / name, arguments.overwrite, inputs=[arguments.nodes] if arguments.nodes else [])
    with Reader(arguments.ring, arguments.wait, arguments.ring_owner) as reader:
        feed = Feed(reader)
        if not arguments.backlog:
            feed.skip()
        try:
            arguments.out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise unwritable(arguments.out, error) from error
        return _calibrate(arguments, feed, names, node)


def _node(arguments) -> int | None:
    """Serial number of the lane's node, where a list of nodes is given."""
    if arguments.nodes is None or arguments.lane is None:
        return None
    nodes = read_nodes(arguments.nodes)
    if arguments.lane not in nodes:
        raise NodeError(
            f"{arguments.nodes}: lane {arguments.lane} has no node with a serial number; see whisker info --nodes"
        )
    return nodes[arguments.lane]


def _calibrate(arguments, feed: Feed, names: list[str], node: int | None) -> int:
    _ask(arguments, feed, "Leave all whiskers untouched")
    frames = feed.frames(round(arguments.rest_seconds * TICKS_PER_S))
    rests = measure_rest(frames)
    if arguments.overwrite or not (arguments.out / REST).exists():
        write_rest(arguments.out / REST, rests, names)
    print(_rest_said(rests, names))
    for rest in rests:
        print(_rest_line(rest, names))
    if arguments.lane is None:
        return 0
    path = arguments.out / f"{names[arguments.lane]}.csv"
    finder = WhiskFinder(arguments.lane)
    for _ in finder.add(frames):
        continue  # the rest of a whisker that is touched now and then is still its rest
    whisks = collect(feed, finder)
    number, wanted = itertools.count(1), len(arguments.radii) * arguments.repeats
    with (
        made(path, arguments.overwrite, grows=True) as place,
        closing(ContactsFile(place, arguments.whisk_rad_s, node)) as file,
    ):
        for radius_mm in arguments.radii:
            text = (
                f"Post at {radius_mm:g} mm, {names[arguments.lane]} clear of it; then whisk {arguments.repeats} times"
            )
            if _ask(arguments, feed, text):
                finder = WhiskFinder(arguments.lane)  # what happened while the post was moved is no contact
                whisks = collect(feed, finder)
            for whisk in itertools.islice(whisks, arguments.repeats):
                file.add(radius_mm, whisk)
                print(_progress(radius_mm, whisk, next(number), wanted), flush=True)
    print(_verdict(path))
    return 0


def _ask(arguments, feed: Feed, text: str) -> bool:
    """Wait for Enter, and forget what came meanwhile; False when nothing is to be asked."""
    if arguments.yes:
        return False
    print(f"{text}; press Enter ", end="", flush=True)
    sys.stdin.readline()
    feed.skip()
    return True


def _rest_said(rests: list[Rest], names: list[str]) -> str:
    noisiest = max(rests, key=lambda rest: max(rest.noise), default=None)
    doubted = [names[rest.lane] for rest in rests if rest.trouble]
    worst = f"; the most noise: {names[noisiest.lane]}, {max(noisiest.noise):.1f} counts" if noisiest else ""
    return f"{len(rests)} lanes at rest{worst}" + (f"; look at {', '.join(doubted)}" if doubted else "")


def _rest_line(rest: Rest, names: list[str]) -> str:
    numbers = f"rest ({rest.mean[0]:.1f}, {rest.mean[1]:.1f})  noise ({rest.noise[0]:.1f}, {rest.noise[1]:.1f}) counts"
    warning = f"  warning: {rest.trouble}" if rest.trouble else ""
    return f"{rest.lane:>2} {names[rest.lane]:<15} {numbers}{warning}"


def _progress(radius_mm: float, whisk: Whisk, number: int, wanted: int) -> str:
    """What one contact was, and what to do better."""
    contact = Contact(whisk.t_s, whisk.counts)
    press = press_of(contact, ONSET_SHARE * reach_of(contact))
    begun = f"  {number} of {wanted}, {radius_mm:g} mm: "
    if press is None or not press.seconds > 0.0:
        return begun + "no whole whisk; push at a steady rate and back again, without pressing twice"
    return begun + f"pushed for {press.seconds:.2f} s, peak {np.linalg.norm(press.deflection[-1]):.0f} counts"


def _verdict(path: Path) -> str:
    whisks = read_whisks(path, with_radius=True, warn=warn)
    try:
        found = fit(whisks)
    except ValueError as error:
        return f"{path}: {len(whisks.contact)} contacts; {error}"
    line = found.tried["linear"][0]
    errors = (
        f"places left out: RMS error {line:.2f} mm with the paper's line, {found.place_mm:.2f} mm with the best model"
    )
    return f"{path}: {len(whisks.contact)} contacts, {errors}; next: whisker radial fit {path}"
