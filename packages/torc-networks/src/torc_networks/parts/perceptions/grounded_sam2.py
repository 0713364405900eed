"""Grounding DINO and SAM 2, which find objects by words."""

from torc_networks.sam.perception import GroundedSam2Perception as PART
