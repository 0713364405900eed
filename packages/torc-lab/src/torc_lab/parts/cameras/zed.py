"""Stereolabs ZED by its SDK: colour, depth, pair (not run yet)."""

from torc_lab.cameras.zed_sdk import ZedCamera as PART
