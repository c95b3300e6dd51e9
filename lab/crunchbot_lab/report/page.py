"""Puts figures and tables on one page that opens without a network."""

from html import escape
from pathlib import Path

import numpy as np

from . import figures
from .html import card_row, document, figure, percent, table
from .run import FILTERS, Run

PAPER_STD_MM = (5.68, 2.78, 1.82, 4.37)  # the paper's table under Fig. 5, whiskers 1 to 4


def write_report(folder: Path) -> Path:
    """Read the run in `folder` and write its report.html; returns the file's path."""
    run = Run.load(folder)
    path = folder / "report.html"
    path.write_text(render(run))
    return path


def render(run: Run) -> str:
    """The page as text."""
    s = run.summary
    parts = [
        f"<h1>CrunchBot: from magnet to pose, seed {s['seed']}</h1>",
        f'<p class="lead">{_lead(s)}</p>',
        _cards(s),
        "<h2>Where it was, and where it thought it was</h2>",
        figure(
            figures.svg(figures.arena, run),
            "The arena from above. Black blocks are obstacles. The belief starts 0.2 m and 10 degrees wrong.",
        ),
        figure(
            figures.svg(figures.errors, run), "Every step from the first is counted. Medians are in the table below."
        ),
        _estimates_table(run),
        "<h2>Floor texture</h2>",
        figure(
            figures.svg(figures.texture, run),
            "One mark for each 100 ms window that was read; none is read during body whisks, at rest, or while the speed changes. "
            f"Accuracy {percent(s['texture_accuracy'])} at least 50 mm inside a tile ({percent(s['texture_windows_share'])} of moving windows), "
            f"{percent(s['texture_accuracy_all'])} of all windows read.",
        ),
        "<h2>Distance along the whisker</h2>",
        figure(
            figures.svg(figures.radial, run),
            "Five calibration contacts per 10 mm fit each line; the errors below are of contacts that were held out. "
            "Markers of the two sets are shifted by 1.5 mm either way to be seen apart.",
        ),
        _radial_table(run),
        "<h2>The base</h2>",
        base_table(run),
        "<h2>Throughput and loss</h2>",
        loss_table(s),
        network_table(run),
        f"<p>Every topic of the run, for ROS 2 tools and Foxglove: <code>{escape(run.bag.name)}</code>, beside this page.</p>",
    ]
    return document(f"CrunchBot demo, seed {s['seed']}", parts)


def _lead(s: dict) -> str:
    return (
        f"{s['simulated_s']:g} s of random exploration with {s['lanes']} whiskers. Sensor, firmware, lanes, USB, ring, the base's driver, "
        "network and filters are the real parts or their bit-true models; arena, whisker mechanics and the base are simulated."
    )


def _cards(s: dict) -> str:
    cards = (
        (f"{s['pose_error_median_m'] * 1000:.0f} mm", "median position error, grid"),
        (percent(s["texture_accuracy"]), "texture windows right"),
        (f"{s['frames_lost']}", f"frames lost of {s['frames_sent']:,}"),
        (
            "equal" if s["records_bad_match"] else "NOT EQUAL",
            f"{s['records_bad_injected']} bad records injected and reported",
        ),
        (f"{s['simulated_s'] / s['chain_wall_s']:.2f} x", "of real time, whole chain"),
    )
    return card_row(cards)


def _estimates_table(run: Run) -> str:
    rows = []
    for name in FILTERS:
        position, heading = run.position_error(name), run.heading_error(name)
        values = (np.median(position), np.quantile(position, 0.9), np.median(heading))
        rows.append((figures.TITLES[name], *(f"{value:.3f}" for value in values)))
    return table("Errors over all steps", ("estimate", "median (m)", "90 % (m)", "heading, median (rad)"), rows)


def _radial_table(run: Run) -> str:
    s = run.summary
    paper = dict(zip(run.object_names, PAPER_STD_MM, strict=False))
    rows = [
        (
            name,
            f"{s['radial_std_mm'][name]:.2f}",
            f"{s['radial_std_predicted_mm'][name]:.2f}",
            f"{paper[name]:.2f}" if name in paper else "",
        )
        for name in run.object_names
    ]
    return table(
        "Standard deviation of the radial error, mm",
        ("whisker", "held out", "predicted from repeatability", "paper"),
        rows,
    )


def loss_table(s: dict) -> str:
    rows = [
        ("frames made by the bridge", f"{s['frames_sent']:,}"),
        ("distinct frames seen by a separate reader", f"{s['frames_received']:,}"),
        ("frames lost", f"{s['frames_lost']:,}"),
        ("bad records injected (sensor and lane faults)", f"{s['records_bad_injected']:,}"),
        ("bad records reported", f"{s['records_bad_reported']:,}"),
        ("the two sets of (lane, tick)", "equal" if s["records_bad_match"] else "not equal"),
        ("USB faults injected", f"{s['usb_faults_injected']:,}"),
        ("simulated seconds per wall second", f"{s['simulated_s'] / s['chain_wall_s']:.2f}"),
    ]
    return table("The chain from sensor to ring", ("quantity", "value"), rows)


BASE_ROWS = (
    ("frames", "sensor frames of 15 ms, whole"),
    ("corrupt", "frames begun but not whole"),
    ("missed", "frames that never came"),
    ("resyncs", "times the stream was found again"),
    ("reconnects", "times the port was opened again"),
    ("commander_stops", "stops because the pilot was silent"),
    ("mode_losses", "times the base left its mode"),
    ("distance_source", "distance from, at the end"),
    ("angle_source", "angle from, at the end"),
    ("remainder", "what is less than a unit at a reading is"),
)


def base_table(run: Run) -> str:
    """What whisker-base reported of link and odometry when the run was over."""
    base = run.pilot["base"]
    rows = [(text, base[key]) for key, text in BASE_ROWS if key in base]
    model = base.get("model")
    name = (
        f"iRobot Create {model}, by its Open Interface over a serial line" if model else "Wheels without a serial line"
    )
    return table(name, ("quantity", "value"), rows)


def network_table(run: Run) -> str:
    navigator = run.navigator
    rows = [("observation rows sent by the pilot", run.pilot["rows"])]
    rows += [(f"rows {key} by the navigator", navigator[key]) for key in ("weighed", "skipped", "missed", "refused")]
    return table("From netbook to desktop, over zenoh", ("quantity", "value"), rows)
