"""Task planners; `--planner`."""
