"""The simulated camera."""

from torc.sim.robot import as_simulated

PART = as_simulated
