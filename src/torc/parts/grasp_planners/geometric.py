"""Candidates from geometry, scored by a small model."""

from torc.grasping.planner import GeometricGraspPlanner as PART
