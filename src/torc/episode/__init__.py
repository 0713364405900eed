"""Run the loop of look, decide, plan, execute, and report its events to listeners."""
