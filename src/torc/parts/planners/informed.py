"""A reference: tries picks out in the simulation, but does not foresee luck."""

from torc.oracle.informed import InformedPlanner as PART
