"""The simulated camera."""

from torc.sim.robot import as_simulated as PART
