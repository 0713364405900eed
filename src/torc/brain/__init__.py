"""The brain alone: one RGB-D frame with masks in, the next object and the reason out. No simulator, no robot.

>>> from torc.brain import decide_frame, load_frame              # doctest: +SKIP
>>> answer = decide_frame(load_frame("frame.npz"))               # doctest: +SKIP
>>> print(answer.label, answer.decision.reason)                  # doctest: +SKIP
>>> print(answer.grasps[0].T_world_tcp, answer.grasps[0].p)      # doctest: +SKIP
"""

from torc.brain.answer import Answer, Grasp
from torc.brain.deciding import FrameDecider, decide_frame
from torc.brain.text import answer_text
from torc.pipeline.frames import load_frame

__all__ = ["Answer", "FrameDecider", "Grasp", "answer_text", "decide_frame", "load_frame"]
