"""Grasp planners; `--grasps`."""
