"""The oracle, which looks ahead in the simulator for the fewest picks, and planners that it informs."""
