"""Candidates by GraspGenX, from a server."""

from torc_networks.grasping.planners import GraspGenXPlanner as PART
