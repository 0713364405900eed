"""A random object that can be grasped; the target first."""

from torc.task_planning.random_choice import RandomPlanner as PART
