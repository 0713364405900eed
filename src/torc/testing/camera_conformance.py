"""Check what every camera must do: `check_camera(my_camera)`."""

from torc.errors import InputError
from torc.perception.checked_scenes import ask_camera
from torc.pipeline.frames.plausibility import check_intrinsics, check_pose
from torc.registry.kinds import CAMERAS
from torc.robots.protocols import Camera
from torc.testing.conformance import require, trait_faults, unit_faults


def check_camera(camera: Camera) -> None:
    """Take two snapshots of a scene at rest. Raises NonConformanceError with everything broken, or PartError."""
    found = trait_faults(CAMERAS, camera)
    for observation in (ask_camera(camera).observation, ask_camera(camera).observation):
        shape, K, T = observation.depth_m.shape, observation.K, observation.T_world_camera
        if K.shape != (3, 3) or T.shape != (4, 4):
            found.append("K must be the 3x3 intrinsics in pixels, and T_world_camera a rigid 4x4 transform")
        else:
            try:
                check_intrinsics("capture()", K, shape)
                check_pose("capture()", T)
            except InputError as error:
                found.append(str(error))
        pair = observation.pair
        if pair is not None and not (pair.left.shape == pair.right.shape == shape):
            found.append("both pictures of the pair must be as large as depth_m")
        if pair is not None and pair.baseline_m <= 0:
            found.append("the pair's baseline_m must be above 0")
        # A stereo camera may leave depth to the depth stage.
        if pair is None or observation.depth_m.any():
            found += unit_faults(observation.depth_m)
    require("camera", found)
