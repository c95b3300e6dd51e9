"""Tables of docs/results/contact.md."""

from ..store import read_result
from ..tables import lined, named


def kinds(case: str) -> list[dict]:
    return named(read_result("contact")["kinds"][case], "kind")


def places(case: str) -> str:
    return lined(
        kinds(case),
        {
            "contact": "{kind}",
            "n": "{contacts}",
            "place RMS mm": "{point_rms_mm:.2f}",
            "median": "{point_median_mm:.2f}",
            "bound RMS": "{bound_rms_mm:.2f}",
            "bound median": "{bound_median_mm:.2f}",
            "held 90 %": "{point_held_90:100*.0f} %",
            "motion right": "{motion_right:100*.0f} %",
            "refused": "{refused:100*.0f} %",
            "us a sample": "{cost_us:.2f}",
        },
    )


def shapes(case: str) -> str:
    return lined(
        [one for one in kinds(case) if "normal_rms_deg" in one],
        {
            "surface": "{kind}",
            "normal RMS degrees": "{normal_rms_deg:.2f}",
            "held 90 %": "{normal_held_90:100*.0f} %",
            "off the surface RMS mm": "{contour_rms_mm:.2f}",
            "probability of a surface": lambda one: f"{100 * (1 - one['corner']):.0f} %",
            "normals taken": "{taken:100*.0f} %",
            "their RMS degrees": "{taken_rms_deg:.2f}",
            "within 15": "{taken_within_15:100*.0f} %",
        },
    )


def speeds(case: str) -> str:
    return lined(
        [one for one in kinds(case) if "speed_median" in one],
        {
            "object that moves": "{kind}",
            "median error of its speed": "{speed_median:100*.0f} %",
            "within 10 %": "{speed_within_10:100*.0f} %",
            "held 90 %": "{speed_held_90:100*.0f} %",
        },
    )
