"""Robotiq grippers behind a UR controller's URCap."""

from torc.lab.robotiq.gripper import over_urcap as PART
