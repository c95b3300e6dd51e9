"""Tables of docs/results/nav.md and nav_families.md."""

from crunchbot.nav import localise

from ..store import read_result
from ..tables import lined, named, table
from .families import against
from .judge import FIGURES

OURS = localise.default_filter()
PEER = ("filterpy", "particles", "pfilter", "mrpt")  # the first words of other projects' filters


def dominated() -> str:
    """By family: the points that are at least as quick and as near as the default filter."""
    rows, peers = [], read_result("nav_peers")
    for family, points in read_result("nav_pareto").items():
        us, error = points[OURS]["us"], points[OURS]["error_m"]
        mine = [title for title, p in points.items() if title != OURS and p["us"] <= us and p["error_m"] <= error]
        theirs = [p for p in peers if p["family"] == family and p["filter"].split()[0] in PEER]
        better = [p["filter"] for p in theirs if p["step_us_median"] <= us and p["error_median_m"] <= error]
        rows.append([family, ", ".join(better) or ("none" if theirs else "not run"), ", ".join(mine) or "none"])
    return table(["family", "of other projects", "of our own filters"], rows)


def stability() -> str:
    """A row a filter over the whole matrix."""
    found = read_result("nav_matrix")
    rows = []
    for name, sure in found["confidence"].items():
        cells = {title: row[name] for title, row in found["rows"].items()}
        held = [c["coverage_90"] for c in cells.values() if c["coverage_90"] is not None]
        rows.append(
            [name, f"{sum(c['near_at_end'] >= 0.98 for c in cells.values())} of {len(cells)}"]
            + [f"{100 * min(held):.0f} to {100 * max(held):.0f}", str(sum(c["faulty_rows"] for c in cells.values()))]
            + [f"{sure['auc']:.3f}", f"{sure['calibration_error']:.3f}"]
        )
    head = ["filter", "faults after which all runs are near", "90 % region holds, %, least and most"]
    return table([*head, "invalid results", "confidence: area under curve", "calibration error"], rows)


def families() -> str:
    """The default filter on all families of each group, and on all."""
    rows = named(read_result("nav_families")["families"], "family")
    return lined([row for row in rows if row["family"].startswith("all")], {"families": "{family}"} | FIGURES)


def filters() -> str:
    """Every filter on the same draws."""
    found = read_result("nav_filters")
    columns = {
        "filter": "{filter}",
        "locked": "{locked} of {draws}",
        "error, mm": "{error_mm:.1f}",
        "90 % region holds, %": "{coverage:100*.0f}",
        "sure and wrong, %": "{sure_wrong:100*.2f}",
        "log score": "{log_score:.3f}",
        "instructions a row": lambda one: one["instructions"] and f"{one['instructions']:.2g}",
        "of the netbook's, %": lambda one: (
            one["instructions"] and f"{100 * one['instructions'] / found['netbook']:.2g}"
        ),
    }
    return lined(named(found["states"], "filter"), columns)


def worth() -> str:
    """What the default filter is without each mechanism, less what it is with it."""
    found = read_result("nav_worth")["settings"]
    return against({setting: parts["all"] for setting, parts in found.items()}).replace("family", "setting", 1)


WANTED_MM = {"anchor": 20, "robot": 35, "raw": 45, "noisy": 80}


def maps(*parts: str) -> str:
    """Families of these parts of the result."""

    def name(row: dict) -> str:
        return row["family"] if row["rows"] == 3000 else f"{row['family']}, {row['rows'] / 600:.0f} min"

    return lined(
        [row for part in parts for row in named(read_result("map")[part], "family")],
        {
            "family": name,
            "runs": "{runs}",
            "wanted, mm": lambda row: WANTED_MM.get(row["family"].removesuffix("+gyro").removesuffix("+normals"), ""),
            "error, mm": "{error_median_m:1e3*.0f}",
            "worst, mm": "{error_worst_m:1e3*.0f}",
            "odometry better in": "{worse_than_odometry}",
            "from the first pose, mm": "{anchored_median_m:1e3*.0f}",
            "odometry, mm": "{odometry_error_median_m:1e3*.0f}",
            "90 % regions hold, %": "{coverage_90:100*.0f}",
            "faces right, %": "{faces_right:100*.0f}",
            "corners found, %": "{corners_found:100*.0f}",
            "false, %": "{corners_false:100*.0f}",
            "tiles said, %": "{tiles_said:100*.0f}",
            "right, %": "{tiles_right:100*.1f}",
            "us a row": "{step_us_mean:.0f}",
        },
    )


def own_maps() -> str:
    return lined(
        named(read_result("map")["own"], "family"),
        {
            "family": "{family}",
            "runs": "{runs}",
            "locked, true map": "{locked_true}",
            "locked, own map": "{locked_own}",
            "in time": "{in_time}",
            "rows, true": "{true_rows_median:.0f}",
            "rows, own": "{own_rows_median:.0f}",
            "error, true, mm": "{true_error_m_median:1e3*.0f}",
            "error, own, mm": "{own_error_m_median:1e3*.0f}",
            "ratio": "{error_ratio_median:.2f}",
        },
    )


def map_peers() -> str:
    return lined(
        [point for point in read_result("map_peers")["points"] if point["mapper"] != "odometry"],
        {
            "family": "{world}",
            "mapper": "{mapper}",
            "runs": "{runs}",
            "error, mm": "{error_median_m:1e3*.0f}",
            "worst, mm": "{error_worst_m:1e3*.0f}",
            "odometry, mm": "{odometry_error_median_m:1e3*.0f}",
            "us a row": "{step_us_mean:.0f}",
        },
    )


def floors(*filters: str) -> str:
    return lined(
        [run for run in named(read_result("floors"), "log", "filter") if run["filter"] in filters],
        {
            "log": "{log}",
            "filter": "{filter}",
            "rows within 6 cm, %": "{near_share:100*.0f}",
            "median error mm": "{error_median_m:1e3*.0f}",
            "rows to lock": "{rows_to_lock}",
            "us/step": "{step_us_mean:.3g}",
        },
    )
