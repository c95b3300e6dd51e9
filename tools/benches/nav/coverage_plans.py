"""Makes plans of task map, and nothing else: what `nav_tasks` counts the instructions of. Argument: how many."""

import sys

from crunchbot_lab.scenes.tasks import MapLoop, mapping

ROWS, SEED = 300, 1  # driven before, so that there is a map


def plans(count: int) -> None:
    """`count` plans of the demo's robot, with the map that it has after a minute."""
    made = []

    def policy(loop, random):
        made.append(mapping(loop, random))
        return made[0]

    loop = MapLoop("robot", SEED, policy, ROWS)
    loop.run(until_locked=False)
    pose, known = loop.pose(), loop.known()
    for _ in range(count):
        made[0].planned(pose, known)


if __name__ == "__main__":
    plans(int(sys.argv[1]))
