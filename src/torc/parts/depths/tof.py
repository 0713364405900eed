"""With the errors of a time-of-flight camera, in simulation."""

from torc.perception.tof import TofDepth as PART
