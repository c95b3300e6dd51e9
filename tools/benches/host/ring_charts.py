"""Charts of the ring's bench: latency, throughput, and what readers cost the writer."""

from matplotlib.figure import Figure

from .ring_peers import PEERS
from .ring_run import READERS

STYLES = {
    "whisker": {"color": "#0b5394", "marker": "o", "linestyle": "-", "linewidth": 2.2},
    "iceoryx2": {"color": "#c25700", "marker": "^", "linestyle": "--"},
    "aeron": {"color": "#38761d", "marker": "s", "linestyle": "-."},
    "zenoh": {"color": "#741b47", "marker": "D", "linestyle": ":"},
    "zeromq": {"color": "#6b6b6b", "marker": "v", "linestyle": "--"},
    "lcm": {"color": "#000000", "marker": "x", "linestyle": ":"},
    "memory": {"color": "#999999", "marker": "", "linestyle": "-", "linewidth": 1},
}


def of(rows: list[dict], **wanted) -> list[dict]:
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]


def draw_latency(rows: list[dict]) -> Figure:
    figure = Figure(figsize=(10.5, 6.6), layout="constrained")
    panels = figure.subplots(2, 3, sharex=True, sharey=True)
    for line, mode in zip(panels, ("poll", "wait"), strict=True):
        for axes, name in zip(line, ("p50", "p99", "p99.9"), strict=True):
            for peer, (title, *_) in PEERS.items():
                points = [p for p in of(rows, peer=peer, mode=mode, pace="2khz") if p["latency_us"]]
                if points:
                    x, y = [p["readers"] for p in points], [p["latency_us"][name] for p in points]
                    axes.plot(x, y, label=title, **STYLES[peer])
            axes.set(xscale="log", yscale="log", xticks=READERS, xticklabels=READERS)
            axes.set_title(f"readers {mode}: {name}", fontsize=10)
            axes.grid(axis="y", color="0.9")
            if name != "p50":
                axes.axvspan(2.9, 40, color="0.95", zorder=0)
    for axes in panels[-1]:
        axes.set_xlabel("readers, all on one processor")
    for line in panels:
        line[0].set_ylabel("publish to reader (us)")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle("256-byte frames at 2 kHz. Shaded: more readers than processors, so tails are the scheduler's")
    return figure


def draw_throughput(rows: list[dict]) -> Figure:
    figure = Figure(figsize=(9.5, 4.2), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, mode in zip(panels, ("poll", "wait"), strict=True):
        for peer, (title, *_) in PEERS.items():
            points = of(rows, peer=peer, mode=mode, pace="flat")
            if points:
                x, y = [p["readers"] for p in points], [p["delivered_per_s"] for p in points]
                axes.plot(x, y, label=title, **STYLES[peer])
        axes.set(xscale="log", yscale="log", xticks=READERS, xticklabels=READERS)
        axes.set(xlabel="readers, all on one processor", title=f"readers {mode}")
        axes.grid(axis="y", color="0.9")
    panels[0].set_ylabel("frames a second that reach every reader")
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=6, fontsize=8.5, frameon=False
    )
    return figure


def draw_writer(rows: list[dict]) -> Figure:
    """What readers cost the ring's writer: a publication at 2 kHz, and a frame when it publishes without pause."""
    figure = Figure(figsize=(9.5, 3.8), layout="constrained")
    panels = figure.subplots(1, 2)
    places = {readers: i for i, readers in enumerate((0, *READERS))}
    for mode, style in (("poll", STYLES["whisker"]), ("wait", STYLES["iceoryx2"])):
        paced, free = (of(rows, peer="whisker", mode=mode, pace=pace) for pace in ("2khz", "free"))
        paced = sorted(paced, key=lambda p: p["readers"])
        panels[0].plot([places[p["readers"]] for p in paced], [p["publish_ns"] for p in paced], label=mode, **style)
        panels[1].plot([places[p["readers"]] for p in free], [1e9 / p["sent_per_s"] for p in free], label=mode, **style)
    titles = ("2 kHz: median time of one publication", "without pause: time per frame")
    for axes, title in zip(panels, titles, strict=True):
        axes.set_title(title, fontsize=10)
        axes.set_xticks(list(places.values()), list(places))
        axes.set(xlabel="readers", ylabel="ns", yscale="log")
        axes.grid(axis="y", color="0.9")
    panels[0].legend(frameon=False, title="readers")
    return figure
