"""Compare task planners on a real robot, in scenes that a person lays out repeatedly."""
