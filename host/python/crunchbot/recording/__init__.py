"""Recordings: MCAP files of a ring's frames, lossless, that ROS 2 bag tools and Foxglove-type viewers open.

from crunchbot.recording import read

with read("drive.mcap") as recording:
    print(recording.lane_names, recording.complete)
    for frames in recording.blocks():              # arrays of crunchbot.bridge.ring.FRAME, 0.1 s each
        alpha = frames["lane"]["alpha"][:, 2]      # lane 2, counts
"""

from .mcapfile import RecordingError
from .reading import Recording, read

__all__ = ["Recording", "RecordingError", "read"]
