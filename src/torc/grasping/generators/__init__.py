"""Candidate generators: each proposes grasps for one object from its cloud alone; checks come later."""

from torc.grasping.generators.antipodal import propose_antipodal
from torc.grasping.generators.boxes import propose_boxes
from torc.grasping.generators.common import GeneratorInput as GeneratorInput
from torc.grasping.generators.common import RawCandidates as RawCandidates
from torc.grasping.generators.slices import propose_slices

GENERATORS = {"antipodal": propose_antipodal, "slices": propose_slices, "boxes": propose_boxes}
"""All generators by name, in the order of `GraspSet.generator_names`."""
