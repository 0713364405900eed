"""Grasp planners whose candidates come from a network in another process."""
