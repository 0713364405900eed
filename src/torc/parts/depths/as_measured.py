"""What the camera gives; exact in simulation."""

from torc.perception.protocol import AsMeasured as PART
