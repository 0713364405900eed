"""Intel RealSense D400 and kin: colour, depth, infrared pair."""

from torc.cameras.realsense import RealSenseCamera as PART
