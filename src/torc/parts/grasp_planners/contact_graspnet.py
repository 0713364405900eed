"""Candidates by Contact-GraspNet, from a server."""

from torc.grasping.network.contact_graspnet import ContactGraspNetPlanner as PART
