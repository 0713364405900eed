"""A reference: tries picks out in the simulation."""

from torc.episode.oracle.planner import OraclePlanner as PART
