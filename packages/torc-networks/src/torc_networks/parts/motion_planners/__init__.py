"""Motion planners; `--motion`."""
