"""The page of a long run (crunchbot_lab.demo.long): errors and losses over half an hour."""

from pathlib import Path

from . import figures, long_figures
from .html import card_row, document, figure, percent, table
from .long_figures import LOST_M
from .page import base_table, loss_table, network_table
from .run import FILTERS, Run

LEVELS = {
    "signals": "World, pilot and filters without bits and network; wheels without a Create.",
    "bytes": "All processes of the robot; bridge and nodes byte by byte.",
    "rtl": "All processes of the robot; the bridge's gateware cycle by cycle.",
}


def write_report(folder: Path) -> Path:
    """Read the run in `folder` and write its report.html; returns the file's path."""
    run, path = Run.load(folder), folder / "report.html"
    path.write_text(render(run))
    return path


def render(run: Run) -> str:
    """The page as text."""
    s = run.summary
    title = f"CrunchBot: {s['simulated_s'] / 60:g} minutes, seed {s['seed']}"
    parts = [
        f"<h1>{title}</h1>",
        f'<p class="lead">{LEVELS[s["level"]]} Random exploration; the belief starts 0.2 m and 10 degrees wrong.</p>',
        _cards(s),
        "<h2>Where it was</h2>",
        _drawn(
            long_figures.path,
            run,
            "The arena from above. Black blocks are obstacles; dots mark where the robot was while an estimate was lost.",
        ),
        "<h2>How far off</h2>",
        _drawn(long_figures.errors, run, "Every row counts from the first."),
        _drawn(long_figures.shares, run, f"Beyond {LOST_M:g} m an estimate counts as lost."),
        _filters_table(s),
        "<h2>What it met</h2>",
        _counts_table(s),
        *_chain(run),
    ]
    return document(title, parts)


def _drawn(draw, run: Run, caption: str) -> str:
    return figure(figures.svg(draw, run), caption)


def _cards(s: dict) -> str:
    adaptive = s["filters"]["adaptive"]
    return card_row(
        (
            (f"{adaptive['median_m'] * 1000:.0f} mm", "median position error, adaptive"),
            (percent(adaptive["lost_share"]), "of the time lost, adaptive"),
            (percent(s["texture_accuracy"]), "texture windows right"),
            (f"{s['driven_m']:.0f} m", f"driven, {s['tiles_visited']} of {s['tiles']} tiles"),
            (f"{s['simulated_s'] / s['chain_wall_s']:.2f} x", f"of real time, level {s['level']}"),
        )
    )


def _filters_table(s: dict) -> str:
    rows = []
    for name in FILTERS:
        f = s["filters"][name]
        errors = (f"{f[key]:.3f}" for key in ("median_m", "p90_m", "max_m"))
        rows.append(
            (figures.TITLES[name], *errors, percent(f["lost_share"]), f["losses"], f"{f['longest_loss_s']:.1f}")
        )
    header = ("estimate", "median (m)", "90 % (m)", "largest (m)", f"beyond {LOST_M:g} m", "losses", "longest (s)")
    return table("A loss ends when the estimate has been near for a second", header, rows)


def _counts_table(s: dict) -> str:
    rows = [
        ("distance driven (m)", f"{s['driven_m']:.1f}"),
        ("tiles under the robot's middle", f"{s['tiles_visited']} of {s['tiles']}"),
        ("contacts of object whiskers", s["contacts"]),
        ("whisks that gave a distance or a kind of contact", s["whisks"]),
        ("texture windows right, tip 50 mm inside its tile", percent(s["texture_accuracy"])),
    ]
    return table("In the whole run", ("quantity", "value"), rows)


def _chain(run: Run) -> list[str]:
    """What only a run of all processes has."""
    if not run.navigator:
        return []
    return [
        "<h2>The base</h2>",
        base_table(run),
        "<h2>Throughput and loss</h2>",
        loss_table(run.summary),
        network_table(run),
    ]
