"""From the pictures' poses to poses on a table.

`cam_R_w2c` and `cam_t_w2c` say "world to camera" and hold the opposite: the public API and the retrieval paper's
converter multiply them onto the objects' poses in the camera, and the poses that come out of it stand upright on a
horizontal table (scenes/tabletop_structured in https://github.com/DanManN/graspclutter6d_mujoco_sim). Others read them
by their name. So the reading is not believed but measured: an object has one pose in the world, whichever picture it is
computed from, and only one of the two readings makes the pictures of a scene agree.
"""

from dataclasses import dataclass

import numpy as np

from torc.errors import InputError
from torc.generation.graspclutter6d.annotations import AnnotatedScene, AnnotatedView, ObjectAnnotation
from torc.geometry.transforms import Pose, invert

_MAX_VIEWS = 12
_CLEARLY = 0.2
_AGREE_M = 0.02


@dataclass(frozen=True)
class TableScene:
    """A scene in the frame of its table: z up, the origin wherever the data set has it.

    Attributes:
        scene: its number.
        objects: in file order.
        Ts_table_mesh: pose of each object's mesh frame.
        reading: "camera_to_world" or "world_to_camera": what the camera poses turned out to be.
        disagreement_m: median distance between an object's positions by this picture and by another; None where there
            is no other picture with the same objects.
        notes: what was odd, for people.
    """

    scene: int
    objects: tuple[ObjectAnnotation, ...]
    Ts_table_mesh: tuple[Pose, ...]
    reading: str
    disagreement_m: float | None
    notes: tuple[str, ...]


def align_to_table(scene: AnnotatedScene) -> TableScene:
    """The objects' poses in the table frame.

    Raises:
        InputError: by these poses the camera is below the objects, so the frame is not that of a table.
    """
    notes = list(scene.notes)
    direct = _disagreement(scene, inverse=False)
    inverse = _disagreement(scene, inverse=True)
    reading, disagreement = "camera_to_world", direct
    if direct is None or inverse is None:
        notes.append(
            "no second picture shows the same objects, so the camera poses could not be cross-checked"
        )
    elif inverse < _CLEARLY * direct and inverse < _AGREE_M:
        reading, disagreement = "world_to_camera", inverse
        notes.append(
            "the camera poses are world-to-camera here, as their name says and against the public API"
        )
    if disagreement is not None and disagreement > _AGREE_M:
        notes.append(
            f"pictures disagree about where the objects are, by {1000 * disagreement:.0f} mm (median): "
            "this scene's annotation is doubtful"
        )
    view = scene.view
    T_table_camera = _camera_pose(view, reading == "world_to_camera")
    poses = tuple(T_table_camera @ o.T_camera_mesh for o in view.objects)
    height = T_table_camera[2, 3] - float(np.median([T[2, 3] for T in poses]))
    if height <= 0:
        raise InputError(
            f"{scene.directory / 'scene_camera.json'}, picture {view.image}: the camera is {-height:.2f} m below the "
            "objects, so z does not point up from the table. Choose another picture with --annotation."
        )
    return TableScene(scene.scene, view.objects, poses, reading, disagreement, tuple(notes))


def _camera_pose(view: AnnotatedView, inverse: bool) -> Pose:
    return invert(view.camera_pose) if inverse else view.camera_pose


def _disagreement(scene: AnnotatedScene, inverse: bool) -> float | None:
    """Median distance between where this picture and others put the same objects, metres."""
    here = _positions(scene.view, inverse)
    stride = max(1, len(scene.others) // _MAX_VIEWS)
    others = scene.others[::stride]
    if not others:
        return None
    return float(np.median([np.linalg.norm(_positions(v, inverse) - here, axis=1) for v in others]))


def _positions(view: AnnotatedView, inverse: bool) -> np.ndarray:
    T = _camera_pose(view, inverse)
    return np.array([(T @ o.T_camera_mesh)[:3, 3] for o in view.objects])
