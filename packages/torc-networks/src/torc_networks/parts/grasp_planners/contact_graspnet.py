"""Candidates by Contact-GraspNet, from a server."""

from torc_networks.grasping.contact_graspnet import ContactGraspNetPlanner as PART
