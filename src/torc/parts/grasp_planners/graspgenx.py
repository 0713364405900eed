"""Candidates by GraspGenX, from a server."""

from torc.grasping.network.graspgenx import GraspGenXPlanner as PART
