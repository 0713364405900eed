"""Run the loop of look, decide, plan, execute, and tell listeners its events."""
