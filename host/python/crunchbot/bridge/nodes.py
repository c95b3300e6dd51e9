"""Which node is on which lane, from what `whisker info --nodes` printed or what whiskerd wrote to its log.

A calibration belongs to one whisker, and whisks do not give another of the same batch away: the serial number does.
"""

import re
from pathlib import Path

from whisker_protocol import LANES

from ..errors import UserError
from ..files import UnreadableError, read_text

# A row of the table (lane, serial, version) or a line of the log; a node without a number of its own has `none`.
ROW = re.compile(r"^ *(\d+) +(\d+|none) +\d+\.\d+ |\blane (\d+): serial (\d+|none),")


class NodeError(UserError):
    """A list of nodes that cannot be used, or a model of another node's whisker; one line."""


def read_nodes(path: str | Path) -> dict[int, int]:
    """Serial numbers by lane; later lines count. NodeError when the file cannot be read or lists none."""
    try:
        lines = read_text(path).splitlines()
    except UnreadableError as error:
        raise NodeError(f"{path}: {error}; write it with: whisker info --nodes > {path}") from error
    found = {}
    for line in lines:
        if not (row := ROW.search(line)):
            continue
        lane, serial = (row[1], row[2]) if row[1] else (row[3], row[4])
        found.pop(int(lane), None)
        if serial != "none" and int(lane) < LANES:
            found[int(lane)] = int(serial)
    if not found:
        raise NodeError(f"{path}: lists no node with a serial number; write it with: whisker info --nodes > {path}")
    return found


def check_node(model_of: int | None, present: int | None, what: str) -> None:
    """NodeError when both serial numbers are known and differ; `what`: the model, as a person knows it."""
    if model_of is not None and present is not None and model_of != present:
        raise NodeError(
            f"{what}: is of the whisker of node {model_of}, but this is node {present}'s; "
            f"calibrate this one with 'whisker calibrate', or put that one back"
        )
