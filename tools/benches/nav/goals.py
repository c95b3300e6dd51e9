"""The goals of the default filter, and how a page shows them beside what was measured."""

from dataclasses import dataclass

from crunchbot.nav import localise

from ..markdown import table

OURS = localise.default_filter()


@dataclass(frozen=True)
class Goals:
    """Limits set for the default filter before it was measured. Lengths in m, times in us."""

    error_median_m: float = 0.0075
    error_rms_m: float = 0.013
    step_us: float = 50.0
    to_reference: float = 1.25
    distinct: float = 60.0
    coverage: tuple[float, float] = (0.85, 0.95)  # where the model is the world
    coverage_faults: float = 0.8
    locked: float = 0.98
    ratio_global: float = 1.15  # to the grid's rows until lock
    ratio_kidnap: float = 1.5
    until_lock_us: float = 200.0
    p999_us: float = 150.0
    slowest_us: float = 1000.0
    variation: float = 0.05
    soak_rows: int = 1_000_000
    share_of_modes: float = 0.55
    grid_ns: tuple[tuple[int, float], ...] = ((90_000, 1.2), (7_500_000, 2.5))  # most per pose, at so many poses


GOALS = Goals()


def work_budget() -> float:
    return next(standard for name, standard, *_ in localise.settings_list() if name == "adaptive.budget")


def verdicts(rows: list[list[str]]) -> str:
    return table(["figure", "goal", "measured", "met"], rows)


def most(what: str, limit: float, value: float | None, unit: str, measured: str | None = None) -> list[str]:
    """A line of `verdicts`; limit and value in the unit shown."""
    return _line(what, f"at most {_plain(limit)}{unit}", value, unit, measured, value is not None and value <= limit)


def least(what: str, limit: float, value: float | None, unit: str, measured: str | None = None) -> list[str]:
    return _line(what, f"at least {_plain(limit)}{unit}", value, unit, measured, value is not None and value >= limit)


def _line(what: str, goal: str, value: float | None, unit: str, measured: str | None, met: bool) -> list[str]:
    shown = measured or ("-" if value is None else number(value) + unit)
    return [what, goal, shown, "not measured" if value is None else "yes" if met else "no"]


def _plain(limit: float) -> str:
    return f"{limit:.0f}" if limit >= 1e6 else f"{limit:g}"


def picture(name: str, title: str, see: str) -> str:
    return f"\n![{title}](../charts/nav_{name}.svg)\n\n{see}\n"


def number(value: float | None, digits: int = 3) -> str:
    if value is None:
        return "-"
    return f"{value:.0f}" if abs(value) >= 10**digits else f"{value:.{digits}g}"


def percent(value: float | None, digits: int = 0) -> str:
    return "-" if value is None else f"{100 * value:.{digits}f} %"


def mm(value: dict) -> str:
    return f"{1000 * value['median']:.1f} ({1000 * value['low']:.1f}-{1000 * value['high']:.1f})"


def listed(items: list[str]) -> str:
    return ", ".join(items) if items else "none"


def yes(met: bool) -> str:
    return "yes" if met else "no"
