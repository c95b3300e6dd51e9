"""A page that opens without a network, in the live page's look: headings, tiles, figures for two widths, tables."""

import re
from collections.abc import Callable
from html import escape
from pathlib import Path

from crunchbot.view.page import FOLDER as LIVE

from . import figures
from .run import Run

OWN = Path(__file__).resolve().parent / "web"
LIVE_SCRIPTS = (
    "kit.js",
    "map.js",
    "plan.js",
    "belief.js",
    "actors.js",
)  # of the live page, in the order they need each other
DARK = re.compile(r':root\[data-theme="dark"\] (\{.*?\n\})', re.DOTALL)
# Colours of the figures, as drawn for paper -> as the page's style names them.
THEMED = {
    "#000000": "--ink",
    "#303030": "--ink",
    "#c9ced5": "--block",
    "#6b6b6b": "--soft",
    "#8a8a8a": "--soft",
    "#aab2bc": "--gap",
    "#e4e4e4": "--grid",
    "#ffffff": "--card",
    "#0b5394": "--alpha",
    "#c25700": "--beta",
    "#1d7a46": "--good",
    "#b00020": "--bad",
}
COLOUR = re.compile("|".join(THEMED))
UNUSED_ID = re.compile(r' id="(?:figure|axes|patch|line2d|text|legend|matplotlib|PathCollection|FillBetween\w*)[\w.]*"')


def style() -> str:
    """The live page's style, dark where the reader's system is, and what only a report has."""
    live, dark = (LIVE / "style.css").read_text(), "@media (prefers-color-scheme: dark) { :root %s }"
    return DARK.sub(lambda found: dark % found[1], live) + (OWN / "report.css").read_text()


def script() -> str:
    """What draws the motion, for the end of a page that has one."""
    files = [*(LIVE / name for name in LIVE_SCRIPTS), OWN / "motion.js"]
    return "<script>'use strict';\n" + "".join(path.read_text() for path in files) + "</script>"


def document(title: str, lead: str, parts: list[str]) -> str:
    """The whole page; `parts` are HTML, title and lead are text."""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta name="color-scheme" content="light dark"><title>{escape(title)}</title><style>{style()}</style></head>'
        f'<body>\n<header><h1>{escape(title)}</h1><p class="lead">{escape(lead)}</p></header>\n<main>\n'
        + "\n".join(parts)
        + "\n</main></body></html>\n"
    )


def section(title: str, *parts: str) -> str:
    """A card with a heading."""
    return f'<section class="card"><h2>{escape(title)}</h2>{"".join(parts)}</section>'


def folded(title: str, *parts: str) -> str:
    """A card that shows its heading until it is opened."""
    return f'<details class="card"><summary><h2>{escape(title)}</h2></summary>{"".join(parts)}</details>'


def paragraph(text: str) -> str:
    return f"<p>{escape(text)}</p>"


def pairs(rows: list[tuple[str, str]]) -> str:
    """Names with their values; a value between backquotes is code."""
    cells = []
    for name, value in rows:
        code = len(value) > 2 and value[0] == value[-1] == "`"
        shown = f"<code>{escape(value[1:-1])}</code>" if code else escape(value)
        cells.append(f"<dt>{escape(name)}</dt><dd>{shown}</dd>")
    return f'<dl class="pairs">{"".join(cells)}</dl>'


def tiles(rows: list[tuple[str, str, bool]]) -> str:
    """A row of (figure, what it is, whether it is a loss)."""
    return (
        '<div class="tiles">'
        + "".join(
            f'<div class="tile"{" data-loss=yes" if loss else ""}><b>{escape(value)}</b>'
            f'<span class="name">{escape(name)}</span></div>'
            for value, name, loss in rows
        )
        + "</div>"
    )


def table(caption: str, header: tuple, rows: list[tuple]) -> str:
    """A table of texts and numbers, all of them escaped."""
    head = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in header)
    body = "".join(
        f'<tr><th scope="row">{escape(str(first))}</th>' + "".join(f"<td>{escape(str(c))}</td>" for c in rest) + "</tr>"
        for first, *rest in rows
    )
    return f"<table><caption>{escape(caption)}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def figure(draw: Callable[..., figures.Figure], run: Run, text: str, caption: str) -> str:
    """A figure, wide and narrow; `text` says in words what it shows."""
    drawn = "".join(
        f'<div class="{width}">{_spoken(themed(figures.svg(draw, run, width == "narrow")), text)}</div>'
        for width in ("wide", "narrow")
    )
    return f"<figure>{drawn}<figcaption>{escape(caption)}</figcaption></figure>"


def themed(svg: str) -> str:
    """An SVG whose colours are those of the page's style, dark or light; names that nothing refers to are left out."""
    return UNUSED_ID.sub("", COLOUR.sub(lambda found: f"var({THEMED[found[0]]})", svg))


def _spoken(svg: str, text: str) -> str:
    return svg.replace("<svg", f'<svg role="img" aria-label="{escape(text)}"', 1)


def percent(share: float) -> str:
    """A share as text."""
    return f"{100 * share:.1f} %"
