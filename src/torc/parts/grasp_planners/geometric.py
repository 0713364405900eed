"""Candidates from geometry, scored by a small model."""

from torc.grasping.geometric_planner import GeometricGraspPlanner as PART
