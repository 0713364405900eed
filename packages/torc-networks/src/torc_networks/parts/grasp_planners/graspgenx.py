"""Candidates by GraspGenX, from a server."""

from torc_networks.grasping.graspgenx import GraspGenXPlanner as PART
