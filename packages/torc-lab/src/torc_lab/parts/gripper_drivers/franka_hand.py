"""The hand of a Franka arm, by rosbridge."""

from torc_lab.ros.franka_hand import FrankaHand as PART
