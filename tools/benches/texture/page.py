"""The page of faults and of real recordings that the bench writes."""

from .scores import METHODS

HEAD = """# Floor texture: faults and recordings, method by method

Made by `tools/benches texture`. `paper` is the naive Bayes of equation 1, which always answers; `default` the spectral
method, which may say "unknown". [What they do](../texture.md). Share of decisions in percent; `error` is the expected
calibration error; `cut` by how much the wrong decisions fall when the least confident tenth is refused (their number where none is left).
"""
FAULTS = """
## Faults

Simulated floors, one robot, 100 ms windows; each fault strikes recordings never trained on. Of a texture never trained no
answer is right. "Wrong" are answers given; the likeliest class may be wrong where the answer is "unknown".

"""
PEERS = """
## Beside calibrated peers

Windows of 1.7 s, whole runs held out; `area` is that under the risk-coverage curve, in percent. The peers are calibrated by a sigmoid on runs held out.
They judge each window alone; `default` judges it given those before it in the run.

"""
BORDERS = """
## Borders

Strips of random tiles of 0.5 m at 0.1, 0.15 and 0.2 m/s. A border is a change of surface; `false` are events away from borders and from edges that
hold the tip. A border reported more than 250 ms late is among them.

"""
UNTRAINED = """
## Surfaces never trained

Each surface left out of training in turn, with a part of the others' recordings; windows from the fifth of a recording on. Share refused, in percent.
`detected`: the share found by a linear detector on the same features that was trained on the surface too, at 8 % of the others' windows: what the features tell at best.

"""
FACES = """
## Faces of walls

An object whisker's tip slides along a wall that is not trained; windows of 100 ms, `default`. In a drive-by an outer whisker slides along a wall beside the
robot, and one model knows all speeds. Backing off and body whisks are the pilot's own motions, with the model that the demo trains.
Another robot's whiskers are read by the models of this one.

"""
FACES_CONTACT = """
The [contact filter](../contact.md) along the same walls, by their texture and in the same motions (drive-bys at 100 mm/s): share of its reports in which it
knows what is touched, and a normal; the median error of the normal, and how often its 90 % holds; the median error of the place across the wall. The filter
knows no texture.

"""
TERRAINS = {"borealtc": "BorealTC", "vulpi": "Vulpi"}
LEFT_OUT = {
    "floors_left_out": "simulated floors, 100 ms",
    "fabrics_left_out": "FabricSlide, 4 s",
    "boreal_left_out": "BorealTC, 1.7 s",
    "vulpi_left_out": "Vulpi, 1.7 s",
}


def page(results: dict) -> str:
    parts = [HEAD]
    if "stability" in results:
        parts += [FAULTS, faults(results["stability"])]
    if "single_surfaces" in results:
        of = {f"simulated, {name}": pair for name, pair in floors(results).items()}
        of |= {f"FabricSlide, a {what} left out": s for what, s in results.get("fabricslide", {}).items()}
        of |= {f"{n}, 1.7 s, runs left out": results[p] for p, n in TERRAINS.items() if p in results}
        parts += ["\n## Accuracy, refusals, confidence\n\n", recordings(of)]
    if "borders" in results:
        parts += [BORDERS, borders(results["borders"])]
    if any(part in results for part in TERRAINS):
        parts += [PEERS, beside_peers({n: results[p] for p, n in TERRAINS.items() if p in results})]
    if any(part in results for part in LEFT_OUT):
        parts += [UNTRAINED, untrained({n: results[p] for p, n in LEFT_OUT.items() if p in results})]
    if "faces" in results:
        parts += [FACES, faces(results["faces"])]
    if "faces_contact" in results:
        parts += [FACES_CONTACT, faces_contact(results["faces_contact"])]
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


def borders(of: dict[str, dict]) -> str:
    rows = [
        [
            "method",
            "borders",
            "m",
            "reported in 150 ms",
            "false per 10 m",
            "wrong after 100 ms, per border",
            "held: wrong",
        ]
    ]
    for name, s in of.items():
        cells = [name, str(s["borders_crossed"]), f"{s['metres']:.0f}", percent(s["reported_in_150_ms"])]
        late = f"{s['wrong_later_than_100_ms_per_border']:.3f}"
        rows.append([*cells, f"{s['false_borders_per_10_m']:.2f}", late, percent(s["wrong_while_held"])])
    return table(rows)


def beside_peers(of: dict[str, dict]) -> str:
    rows = [["recordings", "method", "right", "unknown", "error", "cut", "area"]]
    for recording, methods in of.items():
        for name, s in methods.items():
            shares = [s[key] for key in ("accuracy", "refused", "calibration_error")]
            cut, area = f"{s['cut_at_a_tenth_refused']:.1f}", f"{100 * s['area_under_risk_coverage']:.2f}"
            rows.append([recording, name, *map(percent, shares), cut, area])
    return table(rows)


def untrained(of: dict[str, dict]) -> str:
    rows = [["recordings", "left out", "it is refused", "detected", "windows", "trained ones are refused", "windows"]]
    for recording, surfaces in of.items():
        for name, s in surfaces.items():
            counts = str(s["windows"]), str(s["trained_windows"])
            shares = [percent(s[key]) for key in ("refused", "detected", "trained_refused")]
            rows.append([recording, name, *shares[:2], counts[0], shares[2], counts[1]])
    return table(rows)


def faces(of: dict[str, dict]) -> str:
    robots = list(dict.fromkeys(key.split("|")[1] for key in of))
    columns = ("right", "wrong", "unknown", "error")
    rows = [["motion", *(f"{robot}: {c}" for robot in robots for c in columns), "windows"]]
    for motion in dict.fromkeys(key.split("|")[0] for key in of):
        scores = [of[f"{motion}|{robot}"] for robot in robots]
        shares = [s[key] for s in scores for key in ("accuracy", "wrong_answers", "refused", "calibration_error")]
        rows.append([motion, *map(percent, shares), str(scores[0]["windows"])])
    return table(rows)


def faces_contact(of: dict[str, dict]) -> str:
    rows = [["motion", "wall", "known", "normals", "error, degrees", "90 % holds", "place, mm", "reports"]]
    for key, s in of.items():
        figures = [f"{s['normal_deg']:.1f}", percent(s["held_90"]), f"{s['place_mm']:.2f}"]
        rows.append([*key.split("|"), percent(s["known"]), percent(s["normals"]), *figures, str(s["reports"])])
    return table(rows)


def percent(share: float) -> str:
    return f"{100 * share:.1f}"


def table(rows: list[list[str]]) -> str:
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]]) + "\n"
