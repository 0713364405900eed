"""Straight lines, and sampled free motions."""

from torc.motion.sampling_planner import SamplingMotionPlanner as PART
