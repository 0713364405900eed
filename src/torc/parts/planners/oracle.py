"""A reference: tries picks out in the simulation."""

from torc.oracle.oracle_planner import OraclePlanner as PART
