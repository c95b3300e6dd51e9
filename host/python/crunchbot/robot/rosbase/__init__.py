"""A base that speaks ROS 2, behind the same socket as whisker-base: a driver, and a guard that stops the wheels without it."""

import struct

# The times of whisker-base (docs/create.md, "What stops the wheels").
COMMANDER_S = 0.3  # a commander silent for so long is taken for gone
SILENCE_S = 0.45  # without odometry: with what is late on the way, the wheels stand within 0.5 s
LEASE_S = 0.2  # a guard, or a driver, silent for so long hangs
LOOK_S = 0.02  # a turn of both processes' loops
ALIVE_S = 0.05  # between two messages of theirs
REPEAT_S = 1.0  # for so long an order of speed zero is repeated when driving has ended
STANDING, DRIVING = b"s", b"d"  # what a driver tells its guard
LEASE = struct.Struct("d")  # what a guard tells its driver: until when the wheels may turn, by CLOCK_MONOTONIC
