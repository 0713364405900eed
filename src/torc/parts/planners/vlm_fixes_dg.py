"""Asks --vlm to correct the dependency graph, then decides as dg-select."""

from torc.vlm.planners import VlmFixesDgPlanner as PART
