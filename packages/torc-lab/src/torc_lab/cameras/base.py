"""What real cameras have in common: opened lazily, checked pictures, a pose in the world."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar, Self

import numpy as np

from torc import Observation, load_workspace
from torc.errors import CameraError
from torc.pipeline.frames.plausibility import check_intrinsics, clean_depth
from torc.registry.kinds import CameraTraits
from torc.workspace.description import Workspace
from torc_lab.cameras.poses import placed, read_pose


class RealCamera(ABC, CameraTraits):
    """A camera that looks at the real world, or at a recording of it. Close it, or use it in a `with`."""

    real = True
    what: ClassVar[str] = "The camera"
    """Beginning of messages."""

    def __init__(self, pose: str | Sequence[float], workspace: Workspace | None = None) -> None:
        """`pose` is a setting as `read_pose` takes it. Raises InputError for one that is none."""
        self._pose = read_pose(pose, workspace or load_workspace())
        self._device: Any = None
        """What the camera has open and `close` closes; None before the first picture."""

    def capture(self) -> Observation:
        """One snapshot, now. The arm's joints are not known: `qpos` is empty.

        Raises as `unplaced`, and InputError if the pose is to be estimated, and no support is in sight.
        """
        return placed(self.unplaced(), self._pose)

    def unplaced(self) -> Observation:
        """One snapshot, now, in the camera's own frame: its pose is not known.

        Raises CameraError where the camera cannot be opened, or gives nothing; the next call opens it anew. Raises
        InputError for a picture that makes no sense (no depth, a wrong unit, intrinsics of another size), and
        MissingDependencyError without its library.
        """
        try:
            seen = self._shoot()
        except CameraError:
            self.close()
            raise
        check_intrinsics(self.what, seen.K, seen.depth_m.shape)
        if seen.pair is None or seen.depth_m.any():
            seen = replace(seen, depth_m=clean_depth(self.what, seen.depth_m))
        return replace(seen, T_world_camera=np.eye(4), pose_estimated=True)

    @abstractmethod
    def _shoot(self) -> Observation:
        """What the camera sees now; its pose does not count. A camera that only gives a stereo pair has depth 0."""

    def close(self) -> None:
        """Frees the device; may be called twice. The next capture opens it again."""
        device, self._device = self._device, None
        if device is not None:
            device.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
