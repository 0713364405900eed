"""Intel RealSense D400 and kin: colour, depth, infrared pair."""

from torc_lab.cameras.realsense import RealSenseCamera as PART
