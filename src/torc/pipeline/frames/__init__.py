"""One RGB-D frame with masks, from anywhere: read, checked, and turned into an Observation.

docs/frames.md lists what the two forms, a .npz file and a directory, hold. Without `target` label 0 is the target; if
no object has that label, the frame is refused.
"""

from torc.pipeline.frames.files import load_frame, save_frame
from torc.pipeline.frames.forms import Frame

__all__ = ["Frame", "load_frame", "save_frame"]
