"""SAM 3, which finds objects by words."""

from torc.perception.sam.perception import Sam3Perception as PART
