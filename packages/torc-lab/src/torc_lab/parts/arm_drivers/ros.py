"""Arms that ROS 1 or 2 drives, by rosbridge."""

from torc_lab.ros.arm import RosArm as PART
