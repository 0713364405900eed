"""Candidates by Contact-GraspNet, from a server."""

from torc_networks.grasping.planners import ContactGraspNetPlanner as PART
