"""Robotiq grippers with two fingers: 2F-85 and 2F-140."""
