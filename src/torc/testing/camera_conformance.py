"""Check what every camera must do: `check_camera(my_camera)`."""

import numpy as np

from torc.perception.checked_scenes import ask_camera
from torc.registry.kinds import CAMERAS
from torc.robots.protocols import Camera
from torc.testing.conformance import require, trait_faults, unit_faults


def check_camera(camera: Camera) -> None:
    """Take two snapshots of a scene at rest. Raises NonConformanceError with everything broken, or PartError."""
    found = trait_faults(CAMERAS, camera)
    for observation in (ask_camera(camera).observation, ask_camera(camera).observation):
        height, width = observation.depth_m.shape
        K, T = observation.K, observation.T_world_camera
        if K.shape != (3, 3) or K[0, 0] <= 0 or K[1, 1] <= 0 or K[2].tolist() != [0, 0, 1]:
            found.append("K must be the 3x3 intrinsics in pixels")
        elif not (0 < K[0, 2] < width and 0 < K[1, 2] < height):
            found.append("the principal point of K lies outside of the image: K is of another image size")
        R = T[:3, :3]
        if T.shape != (4, 4) or not np.allclose(R @ R.T, np.eye(3), atol=1e-4) or np.linalg.det(R) < 0:
            found.append("T_world_camera must be a rigid 4x4 transform")
        pair = observation.pair
        if pair is not None and not (pair.left.shape == pair.right.shape == (height, width)):
            found.append("both pictures of the pair must be as large as depth_m")
        if pair is not None and pair.baseline_m <= 0:
            found.append("the pair's baseline_m must be above 0")
        # A stereo camera may leave depth to the depth stage.
        if pair is None or observation.depth_m.any():
            found += unit_faults(observation.depth_m)
    require("camera", found)
