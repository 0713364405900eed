"""The simulated world and the simulated robot."""
