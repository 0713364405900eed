"""Image topics of ROS 1 or 2, by rosbridge."""

from torc_lab.cameras.ros import RosCamera as PART
