"""Draws docs/pictures/behaviour.svg from the pilot's transition table: python tools/behaviour_diagram.py.

States are boxes, arrows carry the numbers of the rules below the picture; dashed ones begin in any state, grey states are the body whisk's. `--check` compares
with the file that is there and exits 1 if it differs.
"""

import argparse
import math
import sys
from pathlib import Path
from xml.sax.saxutils import escape

from crunchbot.pilot.rules import RULES, Rule
from crunchbot.pilot.states import WHISKING, State

OUT = Path(__file__).resolve().parents[1] / "docs" / "pictures" / "behaviour.svg"
BOX = (132, 34)
COLUMN, ROW, LEFT, TOP = 190, 96, 100, 50
# Column and row of each state.
PLACES = {
    State.STOPPED: (0, 0),
    State.SETTLE: (1, 0),
    State.FORWARD: (2, 0),
    State.TURN_AWAY: (3, 0),
    State.TURN: (1, 1),
    State.ESCAPE: (4, 1),
    State.WAIT: (0, 1),
    State.CLEAR: (1, 2),
    State.BACK_OFF: (2, 2),
    State.HALT: (4, 2),
    State.RETREAT: (2, 3),
    State.WHISK_IN: (3, 3),
    State.HOLD: (1, 4),
    State.WHISK_OUT: (2, 4),
    State.PUSH: (3, 4),
}
WIDTH, PICTURE_HEIGHT, LINE, LIST_ROWS = 980, 520, 17, 16


def centre(state: State) -> tuple[float, float]:
    column, row = PLACES[state]
    return LEFT + COLUMN * column, TOP + ROW * row


def border(state: State, towards: State, shift: float) -> tuple[float, float]:
    """Where the line between two boxes' centres, moved to its left by `shift`, leaves the first."""
    (x, y), (to_x, to_y) = centre(state), centre(towards)
    length = math.hypot(to_x - x, to_y - y)
    dx, dy = (to_x - x) / length, (to_y - y) / length
    aside_x, aside_y = -shift * dy, shift * dx
    out_x = (BOX[0] / 2 - math.copysign(aside_x, aside_x * dx)) / abs(dx) if dx else math.inf
    out_y = (BOX[1] / 2 - math.copysign(aside_y, aside_y * dy)) / abs(dy) if dy else math.inf
    out = min(out_x, out_y)
    return x + aside_x + out * dx, y + aside_y + out * dy


def box(state: State) -> list[str]:
    x, y = centre(state)
    fill = "#ddd" if state in WHISKING else "#fff"
    left, top = x - BOX[0] / 2, y - BOX[1] / 2
    return [
        f'<rect x="{left:g}" y="{top:g}" width="{BOX[0]}" height="{BOX[1]}" rx="6" fill="{fill}" stroke="#000"/>',
        f'<text x="{x:g}" y="{y + 5:g}" text-anchor="middle">{state.value}</text>',
    ]


def arrows() -> list[str]:
    """One arrow for all rules between the same two states."""
    lines = []
    between: dict[tuple[State, State], list[int]] = {}
    for number, rule in enumerate(RULES, start=1):
        if rule.source is not None:
            between.setdefault((rule.source, rule.target), []).append(number)
    for target in dict.fromkeys(rule.target for rule in RULES if rule.source is None):
        lines += from_any(
            target, [n for n, rule in enumerate(RULES, start=1) if (rule.source, rule.target) == (None, target)]
        )
    for (source, target), numbers in between.items():
        lines += loop(source, numbers) if source == target else arrow(source, target, numbers)
    return lines


def from_any(target: State, numbers: list[int]) -> list[str]:
    """A short dashed arrow from below, for rules of any state."""
    x, y = centre(target)
    x, y = x - 45, y + BOX[1] / 2
    dashes = 'stroke-dasharray="4 3" marker-end="url(#head)"'
    return [
        f'<line x1="{x:g}" y1="{y + 30:g}" x2="{x:g}" y2="{y:g}" stroke="#000" {dashes}/>',
        *label(x, y + 30, numbers),
    ]


def arrow(source: State, target: State, numbers: list[int]) -> list[str]:
    """Straight, a little to its own left, so that there and back lie side by side."""
    shift = 7.0
    x1, y1 = border(source, target, shift)
    x2, y2 = border(target, source, -shift)
    x, y = x1 + 0.35 * (x2 - x1), y1 + 0.35 * (y2 - y1)
    line = f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="#000" marker-end="url(#head)"/>'
    return [line, *label(x, y, numbers)]


def loop(state: State, numbers: list[int]) -> list[str]:
    x, y = centre(state)
    right = x + BOX[0] / 2
    path = f'<path d="M{right - 24:g} {y + 17:g} v14 h-30 v-12" fill="none" stroke="#000" marker-end="url(#head)"/>'
    return [path, *label(right - 39, y + 33, numbers)]


def label(x: float, y: float, numbers: list[int]) -> list[str]:
    text = ", ".join(map(str, numbers))
    half = 4 + 3.6 * len(text)
    return [
        f'<rect x="{x - half:.1f}" y="{y - 9:.1f}" width="{2 * half:.1f}" height="17" rx="8" fill="#fff" stroke="#777"/>',
        f'<text x="{x:.1f}" y="{y + 4:.1f}" text-anchor="middle" font-size="12">{text}</text>',
    ]


def words(number: int, rule: Rule) -> str:
    source = rule.source.value if rule.source else "any state"
    return f"{number}  {source} \N{RIGHTWARDS ARROW} {rule.target.value}: {rule.reason}"


def legend() -> list[str]:
    """All rules in words, in two columns."""
    lines = []
    for index, rule in enumerate(RULES):
        x, y = 24 + (index // LIST_ROWS) * WIDTH // 2, PICTURE_HEIGHT + LINE * (index % LIST_ROWS)
        lines.append(f'<text x="{x}" y="{y}" font-size="12">{escape(words(index + 1, rule))}</text>')
    return lines


def svg() -> str:
    """The whole picture as text."""
    missing = set(State) - set(PLACES)
    if missing:
        raise SystemExit(f"behaviour_diagram: no place for {missing}; add one to PLACES")
    height = PICTURE_HEIGHT + LINE * LIST_ROWS + 10
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" font-size="14">',
        '<defs><marker id="head" viewBox="0 0 10 10" refX="10" refY="5" markerWidth="8" markerHeight="8" orient="auto">'
        '<path d="M0 0 L10 5 L0 10 z"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{height}" fill="#fff"/>',
        *arrows(),
        *(part for state in State for part in box(state)),
        *legend(),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="only compare; exit 1 if the picture is not the table's")
    options = parser.parse_args(argv)
    if options.check:
        same = OUT.exists() and OUT.read_text() == svg()
        print(f"{OUT}: {'the table' if same else 'not the table; run tools/behaviour_diagram.py'}")
        return int(not same)
    OUT.write_text(svg())
    return 0


if __name__ == "__main__":
    sys.exit(main())
