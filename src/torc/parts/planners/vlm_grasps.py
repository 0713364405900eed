"""Asks --vlm, which also reads what can be grasped."""

from torc.vlm.select import VlmGraspsPlanner as PART
