"""Keeps track of where a hidden target may be, and searches for the cheapest order."""

from torc.task_planning.belief.belief_planner import BeliefPlanner as PART
