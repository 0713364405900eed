"""The planner `belief`: where a hidden target may be, as particles, and the exact search for what to remove first."""
