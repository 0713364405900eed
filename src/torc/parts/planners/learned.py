"""A small model trained on what simulated picks led to."""

from torc.task_planning.learned.learned_planner import LearnedPlanner as PART
