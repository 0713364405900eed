"""Yaskawa controllers with MotoROS, by simple message."""

from torc_lab.simple_message.arm import MotomanArm as PART
