"""Free motions by a planner in another process; straight ones and all checks stay torc's own."""
