"""Arms of Universal Robots, by RTDE."""

from torc.lab.ur.arm import UrArm as PART
