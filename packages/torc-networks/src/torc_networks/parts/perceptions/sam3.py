"""SAM 3, which finds objects by words."""

from torc_networks.sam.perception import Sam3Perception as PART
