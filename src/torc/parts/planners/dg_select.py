"""The paper's planner: the most probable sink of a dependency graph."""

from torc.task_planning.dg_select import DgSelectPlanner as PART
