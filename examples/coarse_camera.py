"""A camera of one's own: every second pixel of the simulated one.

torc run --camera examples/coarse_camera.py:CoarseCamera --camera.step 2
"""

from dataclasses import replace

import numpy as np

from torc.protocols import Camera, Capture, as_capture


class CoarseCamera:
    """Looks through the camera that it is given, with fewer pixels."""

    def __init__(self, camera: Camera, step: int = 2) -> None:
        self.camera, self.step = camera, step

    def capture(self) -> Capture:
        """One snapshot; the intrinsics belong to the smaller image."""
        seen, n = as_capture(self.camera.capture()), self.step
        full, label = seen.observation, seen.label_image
        K = full.K.copy()
        K[:2] /= n
        coarse = replace(
            full,
            rgb=np.ascontiguousarray(full.rgb[::n, ::n]),
            depth_m=np.ascontiguousarray(full.depth_m[::n, ::n]),
            K=K,
        )
        return Capture(coarse, None if label is None else np.ascontiguousarray(label[::n, ::n]))
