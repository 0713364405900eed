"""A trial: an episode played in simulation, written to a directory, and read back."""
