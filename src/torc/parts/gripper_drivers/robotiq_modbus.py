"""Robotiq grippers on a serial line, or by Modbus TCP."""

from torc.lab.robotiq.gripper import over_modbus as PART
