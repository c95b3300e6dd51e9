"""A page that opens without a network: one HTML document of headings, cards, figures and tables."""

from html import escape

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1b1b1b; background: #fff; max-width: 70rem; margin: 2rem auto; padding: 0 1.25rem; }
h1 { font-size: 1.7rem; margin: 0 0 .3rem; } h2 { font-size: 1.2rem; margin: 2.2rem 0 .4rem; }
.lead { color: #444; margin: 0 0 1rem; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(11rem, 1fr)); gap: .8rem; margin: 1.2rem 0; }
.card { border: 1px solid #ccc; border-radius: 6px; padding: .6rem .8rem; } .card b { display: block; font-size: 1.35rem; }
.card span { color: #555; font-size: .85rem; }
figure { margin: .6rem 0; overflow-x: auto; } figure svg { width: 100%; height: auto; min-width: 44rem; }
figcaption { color: #444; font-size: .9rem; }
table { border-collapse: collapse; margin: .6rem 0; } caption { text-align: left; color: #444; font-size: .9rem; padding-bottom: .3rem; }
th, td { border-bottom: 1px solid #ddd; padding: .25rem .9rem .25rem 0; text-align: right; font-variant-numeric: tabular-nums; }
th:first-child, td:first-child { text-align: left; }
"""


def document(title: str, parts: list[str]) -> str:
    """The whole page; `parts` are HTML, the title is text."""
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>{escape(title)}</title><style>{STYLE}</style></head><body>\n" + "\n".join(parts) + "\n</body></html>\n"
    )


def card_row(pairs: tuple[tuple[str, str], ...]) -> str:
    """A row of figures, each with what it is."""
    return (
        '<div class="cards">'
        + "".join(f'<div class="card"><b>{b}</b><span>{t}</span></div>' for b, t in pairs)
        + "</div>"
    )


def table(caption: str, header: tuple, rows: list[tuple]) -> str:
    """A table of texts and numbers, all of them escaped."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
    body = "".join("<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><caption>{escape(caption)}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def figure(svg: str, caption: str) -> str:
    """An SVG as it is, with its caption."""
    return f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>"


def percent(share: float) -> str:
    """A share as text."""
    return f"{100 * share:.1f} %"
