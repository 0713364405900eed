"""Robotiq grippers on a serial line, or by Modbus TCP."""

from torc_lab.robotiq.gripper import over_modbus as PART
