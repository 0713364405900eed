"""Asks --vlm, which sees the picture alone."""

from torc.vlm.planners import VlmSelectPlanner as PART
