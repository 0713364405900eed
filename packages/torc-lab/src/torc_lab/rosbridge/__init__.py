"""ROS from outside: ROS is not needed on this machine."""
