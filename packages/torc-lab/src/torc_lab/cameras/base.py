"""What real cameras share: they open lazily, check their pictures, and have a pose in the world."""

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
        """Read the camera's pose, a setting that `read_pose` accepts. Raises InputError if it is invalid."""
        self._pose = read_pose(pose, workspace or load_workspace())
        self._device: Any = None
        """The open device, which `close` closes; None before the first picture."""

    def capture(self) -> Observation:
        """Return one snapshot, taken now. The joint positions are unknown: `qpos` is empty.

        Raises as `unplaced`, and InputError if the pose must be estimated but no support is in sight.
        """
        return placed(self.unplaced(), self._pose)

    def unplaced(self) -> Observation:
        """Return one snapshot, taken now, in the camera's own frame, as its pose is unknown.

        Raises:
            CameraError: the camera cannot be opened, or returns nothing; the next call opens it again.
            InputError: the picture makes no sense (no depth, a wrong unit, intrinsics of another size).
            MissingDependencyError: the camera's library is not installed.
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
        """Return a picture taken now; its pose is ignored. A camera that only returns a stereo pair has depth 0."""

    def close(self) -> None:
        """Free the device; may be called twice. The next capture opens it again."""
        device, self._device = self._device, None
        if device is not None:
            device.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
