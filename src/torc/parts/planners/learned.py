"""A small model trained on what simulated picks led to."""

from torc.task_planning.learned.planner import LearnedPlanner as PART
