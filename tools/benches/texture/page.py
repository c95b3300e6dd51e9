"""The page of faults and of real recordings that the bench writes."""

from .scores import METHODS

HEAD = """# Floor texture: faults and recordings, method by method

Made by `tools/benches texture`. `paper` is the naive Bayes of equation 1, which always answers; `default` the spectral
method, which may say "unknown". [What they do](texture.md). Share of decisions in percent; `error` is the expected
calibration error; `cut` by how much the wrong decisions fall when the least confident tenth is refused (their number where none is left).
"""
FAULTS = """
## Faults

Simulated floors, one robot, 100 ms windows; each fault strikes recordings never trained on. Of a texture never trained no
answer is right. "Wrong" are answers given; the likeliest class may be wrong where the answer is "unknown".

"""


def page(results: dict) -> str:
    parts = [HEAD]
    if "stability" in results:
        parts += [FAULTS, faults(results["stability"])]
    if "single_surfaces" in results:
        of = {f"simulated, {name}": pair for name, pair in floors(results).items()}
        of |= {f"FabricSlide, a {what} left out": s for what, s in results.get("fabricslide", {}).items()}
        of |= {"BorealTC, 1.7 s, runs left out": results["borealtc"]} if "borealtc" in results else {}
        parts += ["\n## Accuracy, refusals, confidence\n\n", recordings(of)]
    return "".join(parts)


def floors(results: dict) -> dict[str, dict]:
    alone = results["single_surfaces"]
    found = {f"{w // 2} ms": {m: alone[f"{m}|{w}"] for m in METHODS} for w in (50, 100, 200, 400)}
    found["sequential"] = {m: alone[f"{m}|sequential"] for m in METHODS}
    named = {"other_robot": "another robot, 100 ms", "refusals": "surfaces made closer, 50 ms", "borders": "strips, 50 mm inside a tile, 100 ms"}  # fmt: skip
    return found | {text: results[part] for part, text in named.items() if part in results}


def faults(stability: dict) -> str:
    rows = [["fault", *(f"{m}: {c}" for m in ("paper", "default") for c in ("wrong", "unknown", "confidence"))]]
    for fault in dict.fromkeys(key.split("|")[0] for key in stability):
        cells = [fault]
        for s in (stability[f"{fault}|{m}"] for m in METHODS):
            cells += [percent(s["wrong_answers"]), percent(s["refused"]), f"{s['confidence']:.2f}"]
        rows.append(cells)
    return table(rows)


def recordings(of: dict[str, dict]) -> str:
    columns = ("right", "wrong", "unknown", "error", "cut")
    rows = [["recordings", *(f"{m}: {c}" for m in ("paper", "default") for c in columns)]]
    for name, scores in of.items():
        cells = [name]
        for s in (scores[m] for m in METHODS):
            shares = [percent(s[key]) for key in ("accuracy", "wrong_answers", "refused", "calibration_error")]
            cells += [*shares, f"{s['cut_at_a_tenth_refused']:.1f}"]
        rows.append(cells)
    return table(rows)


def percent(share: float) -> str:
    return f"{100 * share:.1f}"


def table(rows: list[list[str]]) -> str:
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]]) + "\n"
