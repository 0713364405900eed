"""ROS from outside: no ROS is needed on this machine."""
