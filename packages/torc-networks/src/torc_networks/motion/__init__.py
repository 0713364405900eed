"""Free motions by a planner in another process; the straight ones, and all checks, stay torc's own."""
