"""Robotiq grippers behind a UR controller's URCap."""

from torc_lab.robotiq.gripper import over_urcap as PART
