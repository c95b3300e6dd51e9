"""Tables of docs/results/contact.md."""

from ..store import read_result
from ..tables import lined, named

MEASURED = (
    "point_median_mm",
    "point_rms_mm",
    "point_worst_mm",
    "point_held_90",
    "bound_rms_mm",
    "motion_right",
    "normal_median_deg",
    "normal_rms_deg",
    "normal_held_90",
    "taken",
    "taken_median_deg",
    "taken_worst_deg",
    "taken_held_90",
    "speed_median",
    "speed_held_90",
)


def kinds(case: str) -> list[dict]:
    """What a kind has not is None."""
    return [dict.fromkeys(MEASURED) | one for one in named(read_result("contact")["kinds"][case], "kind")]


PLACE = {
    "contact": "{kind}",
    "n": "{contacts}",
    "place median mm": "{point_median_mm:.2f}",
    "RMS": "{point_rms_mm:.2f}",
    "worst": "{point_worst_mm:.1f}",
    "held 90 %": "{point_held_90:100*.0f}",
    "refused %": "{refused:100*.0f}",
}


def places(case: str) -> str:
    speeds = {"speed median %": "{speed_median:100*.0f}", "speed held 90 %": "{speed_held_90:100*.0f}"}
    more = {
        "bound RMS": "{bound_rms_mm:.2f}",
        "motion right %": "{motion_right:100*.0f}",
        "us a sample": "{cost_us:.2f}",
    }
    return lined(kinds(case), PLACE | more | speeds)


def shapes(case: str) -> str:
    return lined(
        kinds(case),
        PLACE
        | {
            "normal median deg": "{normal_median_deg:.1f}",
            "RMS deg": "{normal_rms_deg:.1f}",
            "normal held 90 %": "{normal_held_90:100*.0f}",
            "taken %": "{taken:100*.0f}",
            "their median": "{taken_median_deg:.1f}",
            "their worst": "{taken_worst_deg:.0f}",
            "of these held": "{taken_held_90:100*.0f}",
        },
    )
