"""Straight lines, and sampled free motions."""

from torc.motion.planner import SamplingMotionPlanner as PART
