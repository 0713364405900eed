"""Scenes of a small tree in the data set's format, settled."""

from tests.helpers.graspclutter6d_tree import upright, write_tree
from torc.generation.graspclutter6d.placing import ImportConfig, settle_scene
from torc.generation.graspclutter6d.reading import read_scene
from torc.sim.settling import StillnessConfig

OBJECTS = (
    upright(17, 0.0, 0.0, 0.3),
    upright(44, 0.10, 0.05),
    upright(56, -0.10, 0.02, 1.0),
    upright(44, 0.1, -0.06),
)
QUICK = ImportConfig(still=StillnessConfig(seconds=1.0))


def settled(root, scene_objects, scene=249, config=QUICK, **tree):
    write_tree(root, {scene: scene_objects}, images=16, **tree)
    return settle_scene(root, read_scene(root, scene), config)
