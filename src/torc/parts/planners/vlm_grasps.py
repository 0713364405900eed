"""Asks --vlm, which also reads what can be grasped."""

from torc.vlm.planners import VlmGraspsPlanner as PART
