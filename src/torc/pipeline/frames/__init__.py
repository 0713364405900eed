"""Read, check and turn one RGB-D frame from any source, with or without masks, into an Observation.

docs/frames.md lists the contents of the two forms, a .npz file and a directory. Without `target`, label 0 is the
target; a frame in which no object has that label is refused.
"""

from torc.pipeline.frames.frame import Frame, save_frame, save_observation
from torc.pipeline.frames.frame_files import frame_of, load_capture, load_frame

__all__ = ["Frame", "frame_of", "load_capture", "load_frame", "save_frame", "save_observation"]
