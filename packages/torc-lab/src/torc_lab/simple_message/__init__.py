"""Motoman controllers without ROS: the simple_message protocol of their MotoROS driver."""
