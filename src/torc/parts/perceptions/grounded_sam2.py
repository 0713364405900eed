"""Grounding DINO and SAM 2, which find objects by words."""

from torc.perception.sam.perception import GroundedSam2Perception as PART
