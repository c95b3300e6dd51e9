"""The page of a long run (crunchbot_lab.demo.long): errors and losses over half an hour."""

from pathlib import Path

from crunchbot.outputs import put

from . import figures, long_figures, spoken
from .html import document, figure, percent, section, table, tiles
from .long_figures import LOST_M
from .page import chain_cards, origin_card
from .run import FILTERS, Run

LEVELS = {
    "signals": "World, pilot and filters without bits and network; wheels without a Create.",
    "bytes": "All processes of the robot; the bridge's gateware cycle by cycle around requests and faults, else byte by byte.",
    "rtl": "All processes of the robot; the bridge's gateware cycle by cycle.",
}


def write_report(folder: Path) -> Path:
    """Read the run in `folder` and write its report.html; returns the file's path."""
    run, path = Run.load(folder), folder / "report.html"
    put(path, render(run))
    return path


def render(run: Run) -> str:
    """The page as text."""
    s = run.summary
    lead = f"{LEVELS[s['level']]} Random exploration; the belief starts 0.2 m and 10 degrees wrong."
    path = "The arena from above. Grey blocks with a border are obstacles; dots mark where the robot was while an estimate was lost."
    lost = f"Beyond {LOST_M:g} m an estimate counts as lost."
    parts = [
        _tiles(s),
        section("Where it was", figure(long_figures.path, run, spoken.arena(run), path)),
        section(
            "How far off",
            figure(long_figures.errors, run, spoken.errors(run), "Every row counts from the first."),
            figure(long_figures.shares, run, spoken.shares(run), lost),
            _filters_table(s),
        ),
        section("What it met", _counts_table(s)),
        *chain_cards(run),
        origin_card(run),
    ]
    return document(f"CrunchBot: {s['simulated_s'] / 60:g} minutes, seed {s['seed']}", lead, parts)


def _tiles(s: dict) -> str:
    adaptive = s["filters"]["adaptive"]
    return tiles(
        [
            (f"{adaptive['median_m'] * 1000:.0f} mm", "median position error, adaptive", False),
            (percent(adaptive["lost_share"]), "of the time lost, adaptive", adaptive["lost_share"] > 0),
            (percent(s["texture_accuracy_all"]), "texture windows right", False),
            (f"{s['driven_m']:.0f} m", f"driven, {s['tiles_visited']} of {s['tiles']} tiles", False),
            (f"{s['simulated_s'] / s['chain_wall_s']:.2f} x", f"of real time, level {s['level']}", False),
        ]
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
