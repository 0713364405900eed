"""Where a scene of GraspClutter6D is put on our table, and the problem that it becomes. Nothing is settled here."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from torc.errors import UnknownNameError
from torc.generation.graspclutter6d.alignment import TableScene
from torc.generation.graspclutter6d.objects import ConvertedObject
from torc.geometry.transforms import Pose, invert, transform_points, wxyz_from_rotation
from torc.problems.problem import ObjectPlacement
from torc.workspace.description import Workspace


@dataclass(frozen=True)
class PlacementRule:
    """Where the bounding box of a whole scene goes.

    Attributes:
        center_xy: of the box, world, metres.
        lowest_z_m: height of its lower side. Above the table, for the annotated heights are only good to centimetres.
    """

    center_xy: tuple[float, float]
    lowest_z_m: float


PLACEMENTS = {
    # Where the arm reaches best; the fall is short, so that what stands keeps standing.
    "torc": PlacementRule((0.65, -0.12), Workspace().support_z_m + 0.005),
    # As the retrieval paper's converter does it: make_mjcf.py in
    # https://github.com/DanManN/graspclutter6d_mujoco_sim puts the scene's box 5 cm before the middle (.8, 0, 1.05) of
    # the table and 3 cm above it.
    "paper": PlacementRule((0.75, 0.0), 1.08),
}


def placement_rule(name: str) -> PlacementRule:
    """A rule by name. Raises UnknownNameError."""
    if name not in PLACEMENTS:
        raise UnknownNameError("placement", name, list(PLACEMENTS))
    return PLACEMENTS[name]


def place_objects(
    scene: TableScene, objects: Mapping[int, ConvertedObject], rule: PlacementRule
) -> tuple[ObjectPlacement, ...]:
    """The scene's objects in the world, in file order: turned as annotated, moved as a whole.

    Args:
        scene: poses in the table frame.
        objects: by object id.
        rule: where the whole goes.
    """
    poses = [
        T @ invert(objects[o.object_id].T_object_mesh) for o, T in zip(scene.objects, scene.Ts_table_mesh)
    ]
    lower, upper = _bounds(poses, [objects[o.object_id] for o in scene.objects])
    shift = np.array([*rule.center_xy, rule.lowest_z_m]) - [*(lower + upper)[:2] / 2, lower[2]]
    return tuple(
        _placement(o.name, objects[o.object_id].model.name, T, shift) for o, T in zip(scene.objects, poses)
    )


def _bounds(poses: list[Pose], objects: list[ConvertedObject]) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the box around everything visible, table frame."""
    points = [transform_points(T, o.visible_points) for T, o in zip(poses, objects)]
    return np.min([p.min(axis=0) for p in points], axis=0), np.max([p.max(axis=0) for p in points], axis=0)


def _placement(name: str, model: str, T_table_object: Pose, shift: np.ndarray) -> ObjectPlacement:
    x, y, z = (float(v) for v in T_table_object[:3, 3] + shift)
    qw, qx, qy, qz = (float(v) for v in wxyz_from_rotation(T_table_object[:3, :3]))
    return ObjectPlacement(name, model, (x, y, z), (qw, qx, qy, qz))
