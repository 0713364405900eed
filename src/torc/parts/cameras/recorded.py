"""Frames from disk, as torc camera record writes them."""

from torc.cameras.recorded import RecordedCamera as PART
