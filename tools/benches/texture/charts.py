"""Charts of the bench."""

import matplotlib
from matplotlib.figure import Figure

from crunchbot_lab.report.figures import SETTINGS

from .scores import METHODS


def draw(results: dict) -> dict[str, Figure]:
    """Error against decision time, and against time to decide; windows too short for a method are not drawn."""
    figures = {}
    with matplotlib.rc_context(SETTINGS):
        if "single_surfaces" in results:
            figures["texture_time"] = draw_time(results["single_surfaces"])
        if "course" in results:
            figures["texture_course"] = draw_course(results["course"])
        if "cost" in results:
            figures["texture_cost"] = draw_cost(results["cost"])
    return figures


def draw_time(scores: dict) -> Figure:
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    axes = figure.subplots()
    for name, style in zip(
        METHODS, ({"color": "#c25700", "ls": "--", "marker": "^"}, {"color": "#0b5394", "marker": "o"}), strict=True
    ):
        points = [
            (int(key.split("|")[1]), s)
            for key, s in scores.items()
            if key.startswith(name) and "seq" not in key and s["refused"] < 1.0
        ]
        axes.plot(
            [w / 2 for w, _ in points], [100 * (1 - s["accuracy"]) + 0.01 for _, s in points], label=name, **style
        )
        s = scores[f"{name}|sequential"]
        axes.plot(
            s["samples"] / 2,
            100 * (1 - s["accuracy"]) + 0.01,
            "*",
            color=style["color"],
            ms=12,
            label=f"{name}, sequential",
        )
    axes.set(xscale="log", yscale="log", xlabel="decision time (ms)", ylabel="wrong decisions (%, + 0.01)")
    axes.set_title("Simulated floors, 0.05 to 0.2 m/s, recordings not trained on", fontsize=10)
    axes.legend()
    return figure


def draw_cost(scores: dict) -> Figure:
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    axes = figure.subplots()
    for (name, s), marker in zip(scores.items(), "^oDsvPX*", strict=False):
        axes.plot(
            s["us"],
            100 * s["error"] + 0.01,
            marker,
            color="#0b5394" if name in METHODS else "#6b6b6b",
            ms=8,
            label=name,
        )
    axes.set(xscale="log", yscale="log", xlabel="time per decision (us)", ylabel="wrong decisions (%, + 0.01)")
    axes.set_title("100 ms windows of two axes at 2 kHz, one core", fontsize=10)
    figure.legend(fontsize=8, loc="outside right upper")
    return figure


def draw_course(course: dict) -> Figure:
    """The paper's Fig. 4: answers of both whiskers over the true tiles, and their deflections below."""
    figure = Figure(figsize=(6.4, 5.2), layout="constrained")
    panels = figure.subplots(len(METHODS) + 1, 1, sharex=True)
    marks = (("left", "#0b5394", "o"), ("right", "#38761d", "x"))
    for panel, name in zip(panels, METHODS, strict=False):
        for offset, (whisker, (side, color, mark)) in enumerate(zip(course["whiskers"], marks, strict=True)):
            answers = whisker["answers"][name]
            known = [(t, k) for t, k, *_ in answers if k >= 0]
            panel.plot([t for t, _ in known], [k + 0.1 * offset for _, k in known], mark, color=color, ms=4, label=side)
            border = [t for t, *_, b in answers if b]
            panel.plot(border, [-0.6 + 0.1 * offset] * len(border), "|", color=color, ms=8, mew=2)
        panel.set(yticks=[-0.55, *range(len(course["surfaces"]))], ylim=(-1, len(course["surfaces"]) - 0.5))
        panel.set_yticklabels(["border", *(s.lower() for s in course["surfaces"])])
        panel.set_title(name, fontsize=9)
    panels[0].legend(fontsize=8, loc="upper right")
    for whisker, (_, color, _) in zip(course["whiskers"], marks, strict=True):
        trace = whisker["trace_deg"]
        panels[-1].plot([0.02 * n for n in range(len(trace))], trace, color=color, lw=0.8)
    end = 0.02 * len(course["whiskers"][0]["trace_deg"])
    edges = [0.0, *course["whiskers"][0]["met_s"], end]
    for panel in panels:
        for first, last, tile in zip(edges[:-1], edges[1:], course["tiles"], strict=True):
            panel.axvspan(first, last, color="#999999" if tile == course["tiles"][0] else "white", alpha=0.25, lw=0)
    panels[-1].set(xlabel="time (s); shaded: rough carpet", ylabel="deflection\n(deg of field)", xlim=(0, end))
    return figure
