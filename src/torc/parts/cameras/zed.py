"""Stereolabs ZED by its SDK: colour, depth, pair (not run yet)."""

from torc.cameras.zed_sdk import ZedCamera as PART
