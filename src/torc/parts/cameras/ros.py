"""Image topics of ROS 1 or 2, by rosbridge."""

from torc.cameras.ros import RosCamera as PART
