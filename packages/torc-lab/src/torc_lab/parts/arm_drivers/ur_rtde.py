"""Arms of Universal Robots, by RTDE."""

from torc_lab.ur.arm import UrArm as PART
