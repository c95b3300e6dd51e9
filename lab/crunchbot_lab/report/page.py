"""Puts figures and tables on one page that opens without a network."""

from html import escape
from pathlib import Path

import numpy as np

from crunchbot.outputs import put

from . import figures, motion, spoken
from .figures import TITLES
from .html import document, figure, folded, pairs, paragraph, percent, script, section, table, tiles
from .long_figures import LOST_M
from .run import FILTERS, Run

PAPER_STD_MM = (5.68, 2.78, 1.82, 4.37)  # the paper's table under Fig. 5, whiskers 1 to 4
WHAT = {
    "grid": "Exact Bayes on a fixed grid: every cell of the arena and every heading keeps its probability, which odometry moves "
    "and each row of readings multiplies (the paper's eq. 4).",
    "adaptive": "The default: particles, as many as the belief's spread asks for, and a histogram of the whole "
    "arena while the robot may be anywhere; it passes from one to another by itself.",
    "foveal": "The paper's filter: 11 by 11 by 11 poses about the estimate, fused into one Gaussian after each row (eqs. 5-7). Its "
    "mean is one of these, 2.5 cm and 9 degrees apart: by chance worse than the wheels alone, and it may never come back.",
    "odometry": "No whisker at all: adds up what the wheels report, from the wrong start; what the others must beat.",
}


def write_report(folder: Path) -> Path:
    """Read the run in `folder` and write its report.html; returns the file's path."""
    run = Run.load(folder)
    path = folder / "report.html"
    put(path, render(run))
    return path


def render(run: Run) -> str:
    """The page as text."""
    s = run.summary
    parts = [
        f'<p class="verdict">{escape(_verdict(run))}</p>',
        _tiles(s),
        motion.card(run),
        *_spread(run),
        section(
            "How far off",
            figure(figures.errors, run, spoken.errors(run), "Every row counts from the first."),
            _estimates_table(run),
            '<dl class="filters">'
            + "".join(f"<div><dt>{TITLES[n]}</dt><dd>{WHAT[n]}</dd></div>" for n in FILTERS)
            + "</dl>",
        ),
        section("Floor texture", figure(figures.texture, run, spoken.texture(run), _texture_caption(s))),
        section(
            "Distance along the whisker",
            figure(
                figures.radial,
                run,
                spoken.radial(run),
                "Five calibration contacts per 10 mm fit each line; the errors below are of contacts that were held out. "
                "Markers of the two sets are shifted by 1.5 mm either way to be seen apart.",
            ),
            _radial_table(run),
        ),
        *chain_cards(run),
        f'<p class="lead">Every topic of the run, for ROS 2 tools and Foxglove: <code>{escape(run.bag.name)}</code>, '
        "beside this page.</p>",
        origin_card(run),
        script(),
    ]
    return document(f"CrunchBot: from magnet to pose, seed {s['seed']}", _lead(s), parts)


def origin_card(run: Run) -> str:
    """What was run, of which commit, where and when."""
    made = run.origin
    rows = [("Command", f"`{made['command']}`")] if made else []
    rows += [("Seed", f"{run.summary['seed']}"), ("Time", f"{run.summary['simulated_s']:g} s simulated")]
    if made:
        rows += [("Commit", f"{made['commit']}, version {made['version']}"), ("Machine", made["machine"])]
        rows += [("Made", made["date"])]
    return section("This run", pairs(rows))


def chain_cards(run: Run) -> list[str]:
    """Base, losses and network: what only a run of all processes has."""
    if not run.navigator:
        return []
    sheets = "".join((loss_table(run.summary), network_table(run), base_table(run)))
    return [folded("Throughput, loss, base", f'<div class="sheets">{sheets}</div>')]


def _verdict(run: Run) -> str:
    """The result in a sentence: this run's, and what other seeds make of it."""
    medians = {name: 1000 * np.median(run.position_error(name)) for name in FILTERS}
    here = f"{medians['adaptive']:.0f} mm median position error by touch; wheels alone {medians['odometry']:.0f} mm"
    text = f"{here}; the paper's filter {medians['foveal']:.0f} mm"
    if not run.seeds:
        return f"{text}."
    seeds = {name: 1000 * run.seeds[f"{name}_m"] for name in FILTERS}
    median = {name: f"{np.median(errors):.0f} mm" for name, errors in seeds.items()}
    return (
        f"{text}. Medians of {len(run.seeds['seed'])} seeds: {median['adaptive']} by touch, worst "
        f"{seeds['adaptive'].max():.0f} mm; {median['odometry']} by wheels alone; {median['foveal']} by the paper's filter."
    )


def _lead(s: dict) -> str:
    return (
        f"{s['simulated_s']:g} s of random exploration with {s['lanes']} whiskers. Sensor, firmware, lanes, USB, ring, the base's driver, "
        "network and filters are the real parts or their bit-true models; arena, whisker mechanics and the base are simulated."
    )


def _tiles(s: dict) -> str:
    reported, injected = s["records_bad_reported"], s["records_bad_injected"]
    equal = s["records_bad_match"]
    return tiles(
        [
            (f"{s['adaptive_error_median_m'] * 1000:.0f} mm", "median position error, adaptive", False),
            (
                percent(s["texture_accuracy_all"]),
                f"texture windows right; {percent(s['texture_accuracy'])} where 50 mm inside a tile",
                False,
            ),
            (f"{s['frames_lost']}", f"frames lost of {s['frames_sent']:,}", s["frames_lost"] > 0),
            (
                f"{reported} of {injected}" if equal else "NOT EQUAL",
                "bad records put in, all reported, no other" if equal else "bad records put in, and reported",
                not equal,
            ),
            (f"{s['simulated_s'] / s['chain_wall_s']:.2f} x", "of real time, whole chain", False),
        ]
    )


def _texture_caption(s: dict) -> str:
    return (
        "One mark for each 100 ms window that was read; none is read during body whisks, at rest, or while the speed changes. "
        f"Accuracy {percent(s['texture_accuracy'])} at least 50 mm inside a tile ({percent(s['texture_windows_share'])} of moving windows), "
        f"{percent(s['texture_accuracy_all'])} of all windows read."
    )


def _estimates_table(run: Run) -> str:
    rows = []
    for name in FILTERS:
        position, heading = run.position_error(name), np.degrees(run.heading_error(name))
        metres = (np.median(position), np.quantile(position, 0.9), position.max())
        rows.append(
            (
                TITLES[name],
                *(f"{m:.3f}" for m in metres),
                f"{np.median(heading):.1f}",
                percent((position > LOST_M).mean()),
            )
        )
    header = ("estimate", "median (m)", "90 % (m)", "largest (m)", "heading, median (degrees)", f"beyond {LOST_M:g} m")
    return table("Errors over all rows", header, rows)


def _spread(run: Run) -> list[str]:
    """Other seeds beside this one."""
    if not run.seeds:
        return []
    seeds = run.seeds["seed"]
    text = (
        f"One run says little. Seeds {seeds.min():.0f} to {seeds.max():.0f} (other floors, obstacles and starts) were replayed with "
        "the same whiskers and models, at the level of signals: without bits, faults, serial line and network."
    )
    rows = []
    for name in FILTERS:
        errors, here = run.seeds[f"{name}_m"], np.median(run.position_error(name))
        rows.append((TITLES[name], *(f"{m:.3f}" for m in (here, np.median(errors), errors.min(), errors.max()))))
    header = ("estimate", "this run (m)", "median of the seeds (m)", "best (m)", "worst (m)")
    shown = figure(figures.spread, run, spoken.spread(run), "Median position error of each run; logarithmic.")
    return [section("Other seeds", paragraph(text), shown, table("Median position error", header, rows))]


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
