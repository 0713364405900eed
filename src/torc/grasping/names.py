"""Names of grasp planners. Light to import, for the command line."""

DEFAULT_GRASPS = "geometric"
"""The grasp planner that comes with torc."""
