"""Asks --vlm to correct the dependency graph, then decides as dg-select."""

from torc.vlm.fixes_dg import VlmFixesDgPlanner as PART
