"""The planner `belief`: particles of where a hidden target may be, and an exact search for what to remove first."""
