"""One RGB-D frame, with masks or without, from anywhere: read, checked, and turned into an Observation.

docs/frames.md lists what the two forms, a .npz file and a directory, hold. Without `target` label 0 is the target; if
no object has that label, the frame is refused.
"""

from torc.pipeline.frames.frame_files import (
    frame_of,
    load_frame,
    load_observation,
    save_frame,
    save_observation,
)
from torc.pipeline.frames.stored import Frame

__all__ = ["Frame", "frame_of", "load_frame", "load_observation", "save_frame", "save_observation"]
