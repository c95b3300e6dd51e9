"""Tables of docs/results/texture.md."""

from ..store import read_result
from ..tables import lined, named
from .scores import METHODS

SCORES = {"right": "accuracy", "wrong": "wrong_answers", "unknown": "refused", "error": "calibration_error"}
SHORT = dict(zip(METHODS, ("paper", "default"), strict=True))


def both(one: dict, scores: dict[str, str] = SCORES) -> dict[str, str]:
    """Cells of both methods."""
    return {
        f"{SHORT[name]}: {title}": "{%s[%s]:100*.1f}" % (at, key)  # noqa: UP031
        for at, name in one.items()
        for title, key in scores.items()
    }


def pair(of: dict) -> dict:
    return {"paper": of[METHODS[0]], "ours": of[METHODS[1]]}


PAIR = {"paper": METHODS[0], "ours": METHODS[1]}


def faults() -> str:
    found = read_result("texture")["stability"]
    names = dict.fromkeys(key.split("|")[0] for key in found)
    rows = [{"fault": n, "paper": found[f"{n}|{METHODS[0]}"], "ours": found[f"{n}|{METHODS[1]}"]} for n in names]
    columns = both(PAIR, {"wrong": "wrong_answers", "unknown": "refused"})
    columns |= {f"{SHORT[name]}: confidence": "{%s[confidence]:.2f}" % at for at, name in PAIR.items()}  # noqa: UP031
    return lined(rows, {"fault": "{fault}"} | columns)


def recordings() -> str:
    found = read_result("texture")
    alone = found["single_surfaces"]
    of = {
        f"simulated, {title}": {m: alone[f"{m}|{at}"] for m in METHODS}
        for title, at in (("25 ms", 50), ("50 ms", 100), ("100 ms", 200), ("200 ms", 400), ("sequential", "sequential"))
    }
    of |= {
        "simulated, another robot, 100 ms": found["other_robot"],
        "simulated, surfaces made closer, 50 ms": found["refusals"],
        "simulated, strips, 50 mm inside a tile, 100 ms": found["borders"],
        **{f"FabricSlide, a {what} left out": scores for what, scores in found["fabricslide"].items()},
        "BorealTC, 1.7 s, runs left out": found["borealtc"],
        "Vulpi, 1.7 s, runs left out": found["vulpi"],
    }
    columns = both(PAIR)
    columns |= {f"{SHORT[name]}: cut": "{%s[cut_at_a_tenth_refused]:.1f}" % at for at, name in PAIR.items()}  # noqa: UP031
    return lined(
        ({"recordings": name} | pair(scores) for name, scores in of.items()), {"recordings": "{recordings}"} | columns
    )


def cost() -> str:
    return lined(
        named(read_result("texture")["cost"], "method"),
        {"method": "{method}", "wrong, %": "{error:100*.1f}", "us a decision": "{us:.3g}"},
    )


def borders() -> str:
    return lined(
        named(read_result("texture")["borders"], "method"),
        {
            "method": "{method}",
            "borders": "{borders_crossed}",
            "m": "{metres:.0f}",
            "wrong after 100 ms, per border": "{wrong_later_than_100_ms_per_border:.3f}",
            "held: wrong": "{wrong_while_held:100*.1f}",
        },
    )
