"""Asks --vlm, which sees the picture alone."""

from torc.vlm.select import VlmSelectPlanner as PART
