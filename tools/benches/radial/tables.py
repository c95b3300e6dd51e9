"""Tables of docs/results/radial.md."""

from ..store import read_result
from ..tables import table
from .bench import METHODS
from .trials import PAPER_MM

SPREADS = {"0.082": "8.2 %", "0.04": "4.0 %", "0.026": "2.6 %", "0.063": "6.3 %"}  # of whiskers 1 to 4
TITLES = {"paper": "eq. 3"}


def errors() -> str:
    found = read_result("radial")
    rows = []
    for n, (key, spread) in enumerate(SPREADS.items()):
        held = found["errors"]["duration"][key]
        rows.append(
            [f"{n + 1} ({spread})", f"{PAPER_MM[n]:.2f}", f"{found['fig5']['error_mm'][n]:.2f}"]
            + [f"{held[model]:.2f}" for model in (*METHODS, "oracle")]
            + [f"{held['default'] / held['oracle']:.2f}"]
        )
    models = [f"{TITLES.get(model, model)}, held out" for model in (*METHODS, "oracle")]
    return table(["whisker (spread)", "paper, printed", "eq. 3, on its calibration", *models, "default / oracle"], rows)


def one_line() -> str:
    found = read_result("radial")["fig5"]["combined_mm"]
    return table(["one line for all whiskers, mm", "the paper's"], [[f"{found:.2f}", "4.98"]])


def cases() -> str:
    found = read_result("radial")
    of = {
        "angle varies with the duration (table above)": found["errors"]["duration"],
        "angle varies with a rate that nothing reports": found["errors"]["rate"],
        "angle varies with a rate that the base reports to 2 %": found["errors"]["rate, reported"],
        "contact speed 3:1": found["speeds"],
        **{f"sampled at {float(rate):.0f} Hz": case for rate, case in found["rates"].items()},
    }
    rows = [
        [title, *(f"{c[key]['default']:.2f} / {c[key]['oracle']:.2f}" for key in SPREADS)] for title, c in of.items()
    ]
    return table(["case", *SPREADS.values()], rows)


def honesty() -> str:
    found = read_result("radial")
    held, tips = found["errors"]["duration"], found["tips"]
    rows = [
        [f"{what} % interval holds", *(f"{100 * held[key][f'coverage_{what}']:.0f} %" for key in SPREADS)]
        for what in (50, 90)
    ]
    shares = (f"{100 * tips[key]['default']:.1f} % ({100 * tips[key]['paper']:.1f} %)" for key in SPREADS)
    return table(["figure", *SPREADS.values()], [*rows, ["tip or shaft right, default (eq. 3)", *shares]])


def onsets() -> str:
    """Pushes that go wrong: RMS and worst error of what is sure."""
    rows = [
        [
            how,
            "test, and every third of calibration" if where == "both" else "test",
            f"{100 * one['sure']:.0f} % of {one['n']}",
        ]
        + [f"{one['rms_mm']:.1f}, {one['worst_mm']:.1f}", str(one["beyond_10"])]
        for how, of in read_result("radial")["onsets"].items()
        for where, one in of.items()
    ]
    return table(["pushes", "of", "sure", "RMS and worst of these, mm", "beyond 10 mm"], rows)


def stability() -> str:
    def answer(one: dict) -> str:
        return f"{one['error_mm']:.1f}, {one['sigma_mm']:.1f}, {one['confidence']:.2f}"

    found, shown = read_result("radial")["stability"], ("paper", "rational", "default")
    rows = [
        [fault, *(answer(of[model]) for model in shown), str(sum(one["not_a_number"] for one in of.values()))]
        for fault, of in found.items()
    ]
    return table(["fault", *(TITLES.get(model, model) for model in shown), "answers that are NaN, of any model"], rows)
