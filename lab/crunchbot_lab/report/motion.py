"""The run as a motion: what the page's script draws at each row, in the live page's own way.

Poses as [t, x, y, theta], a row each; beliefs as the bag has them, condensed, in 16-bit numbers.
"""

import base64
import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from crunchbot.nav.filters import COMPONENT
from crunchbot.recording.mcapfile import McapFile
from crunchbot.robot.network.belief import condense
from crunchbot.robot.network.messages import Belief, decode
from crunchbot.scene import Scene, load

from .figures import TITLES
from .run import FILTERS, Run

COMPONENTS_MOST = 160  # of a belief on the page
BELIEF_TOPIC = "/belief"
LARGEST = 32767
ROW_NS = 100_000_000
LEGEND = """<ul class="keys" id="motion-textures"><li><i class="mark line"></i>estimate, and where it was</li>
<li><i class="mark dashes"></i>robot as it really went</li><li><i class="mark cloud"></i>belief, arrows: its headings</li>
<li><i class="mark block"></i>obstacle</li></ul>"""


def card(run: Run) -> str:
    """The part of the page with the plans, and the data that its script reads."""
    text = json.dumps(data(run), separators=(",", ":"), allow_nan=False).replace("</", "<\\/")
    return f"""<section class="card" id="motion-card"><h2>The run, filter by filter</h2>
<div class="tools" id="motion-tools"><button id="motion-play" aria-pressed="false">Play</button>
<label>Speed <select id="motion-speed"><option value="1">1 ×</option><option value="4" selected>4 ×</option>
<option value="16">16 ×</option></select></label>
<input type="range" id="motion-time" min="0" step="1" aria-label="Time of the run"><output id="motion-clock"></output></div>
{LEGEND}<div id="motion-plans"></div>
<script type="application/json" id="motion-data">{text}</script></section>"""


def data(run: Run) -> dict:
    """What the script is given."""
    scene = load(run.scene_folder)
    seconds = (run.truth["tick"] + 1) * 500e-6
    scales, robot = scales_of(scene), asdict(replace(scene.robot, sensors=()))
    beliefs = recorded_beliefs(run.bag, seconds, scales) if run.bag.exists() else {}
    return {
        "scene": {"arena": asdict(scene.arena), "origin": scene.origin, "robot": robot, "text": ""},
        "truth": _poses(seconds, run.truth),
        "scales": list(scales),
        "filters": {
            name: {
                "title": TITLES[name],
                "poses": _poses(run.estimates[name]["t_s"], run.estimates[name]),
                "beliefs": beliefs.get(name, []),
            }
            for name in FILTERS
        },
    }


def _poses(seconds: np.ndarray, table: dict[str, np.ndarray]) -> list[list[float]]:
    columns = np.column_stack([seconds, table["x_m"], table["y_m"], table["theta_rad"]])
    return [[round(float(value), 3) for value in row] for row in columns]


def scales_of(scene: Scene) -> tuple[float, ...]:
    """Of x, y, theta, weight, sigma in m and in rad: what one step of a 16-bit number is worth."""
    metres = 2.0 * max(scene.arena.size_m) / LARGEST  # a belief may reach beyond the walls
    return (metres, metres, 4.0 * np.pi / LARGEST, 1.0 / LARGEST, metres, 4.0 * np.pi / LARGEST)


def recorded_beliefs(bag: Path, seconds: np.ndarray, scales: tuple[float, ...]) -> dict[str, list[dict]]:
    """By filter, the beliefs of a bag: {row, total, mass, poses}."""
    found: dict[str, list[dict]] = {}
    with McapFile(bag) as file:
        for message in file.messages():
            if message.topic.endswith(BELIEF_TOPIC):
                belief = decode(Belief, bytes(message.data), message.topic)
                found.setdefault(belief.filter, []).append(_packed(belief, len(seconds), scales))
    return found


def _packed(belief: Belief, rows: int, scales: tuple[float, ...]) -> dict:
    components = np.zeros(len(belief.x), COMPONENT)
    components["pose"] = np.column_stack([belief.x, belief.y, belief.theta])
    components["mass"], components["sigma_m"] = belief.weight, belief.sigma_m
    components["sigma_rad"] = belief.sigma_rad
    few = condense(components, COMPONENTS_MOST)
    columns = np.column_stack([few["pose"], few["mass"], few["sigma_m"], few["sigma_rad"]]) / np.array(scales)
    numbers = np.clip(np.round(columns), -LARGEST, LARGEST).astype("<i2")
    return {
        "row": min(int(belief.observation_seq), rows - 1),
        "total": int(belief.components),
        "mass": round(float(belief.mass), 4),
        "poses": base64.b64encode(numbers.tobytes()).decode(),
    }
