"""Runs the drills: PYTHONPATH=tests python -m drills --minutes 30 --out build/drills"""

import argparse
import json
import sys
from pathlib import Path

from crunchbot.stopping import interrupt_on_signals
from crunchbot_lab.demo.training import learn
from crunchbot_lab.simulation.scenes import make_scene

from .course import FAULTS, Course, as_json
from .machine import Plan


def main() -> int:
    parser = argparse.ArgumentParser(prog="drills", description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0, help="simulated, and of the wall (30)")
    parser.add_argument("--seed", type=int, default=3, help="of scene, robot, order and times of faults (3)")
    parser.add_argument("--level", choices=("bytes", "rtl"), default="bytes", help="of the bridge (bytes)")
    parser.add_argument("--out", type=Path, default=Path("build/drills"), help="logs, bags, truth, results")
    parser.add_argument("--models", type=Path, help="folder of the robot's models (default: learnt)")
    parser.add_argument("--only", action="append", metavar="WORDS", help="faults whose names have these words")
    parser.add_argument("--create", type=int, choices=(1, 2), default=1)
    arguments = parser.parse_args()
    interrupt_on_signals()  # with it all processes end
    out = arguments.out / f"seed{arguments.seed}"
    out.mkdir(parents=True, exist_ok=True)
    models = arguments.models or out / "models"
    if not (models / "texture.json").exists():
        learn(models, make_scene(arguments.seed)[0], arguments.seed, lambda: None)
    faults = [f for f in FAULTS if not arguments.only or any(words in f.name for words in arguments.only)]
    seconds = 60.0 * arguments.minutes
    plan = Plan(out.resolve(), models.resolve(), arguments.seed, seconds, arguments.level, arguments.create)
    course = Course(plan, faults, say=lambda text: print(text, flush=True))
    events = as_json(course.run())
    failures = [
        f"{event['fault']} at {event['at_s']:.1f} s: {wrong}" for event in events for wrong in event["failures"]
    ]
    reported = {"seed": arguments.seed, "level": arguments.level, "create": arguments.create}
    reported |= {"simulated_s": round(course.simulated_s, 1), "wall_s": round(course.wall_s, 1)}
    reported |= {"errors_m": [round(error, 3) for _, error in course.errors], "events": events}
    (out / "drills.json").write_text(json.dumps(reported) + "\n")
    print(
        f"{len(events)} faults in {course.simulated_s:.0f} simulated s ({course.wall_s:.0f} s); {len(failures)} failures"
    )
    print("\n".join(failures), flush=True)
    return int(bool(failures))


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit("drills: stopped")
