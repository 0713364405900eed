"""The hand of a Franka arm, by rosbridge."""

from torc.lab.ros.franka_hand import FrankaHand as PART
