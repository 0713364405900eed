"""A camera of one's own: every second pixel of the simulated one.

torc run --camera examples/coarse_camera.py:CoarseCamera --camera.step 2
"""

from dataclasses import replace

import numpy as np

from torc import Observation
from torc.protocols import Camera


class CoarseCamera:
    """Looks through the camera that it is given, with fewer pixels."""

    def __init__(self, camera: Camera, step: int = 2) -> None:
        self.camera, self.step = camera, step

    def capture(self) -> Observation:
        """One snapshot; the intrinsics belong to the smaller image."""
        full, n = self.camera.capture(), self.step
        K = full.K.copy()
        K[:2] /= n
        label = None if full.label_image is None else np.ascontiguousarray(full.label_image[::n, ::n])
        return replace(
            full,
            rgb=np.ascontiguousarray(full.rgb[::n, ::n]),
            depth_m=np.ascontiguousarray(full.depth_m[::n, ::n]),
            K=K,
            label_image=label,
        )
