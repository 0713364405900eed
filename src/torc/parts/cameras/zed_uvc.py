"""Stereolabs ZED on USB, without its SDK: colour and stereo pair."""

from torc.cameras.zed_uvc import ZedUvcCamera as PART
