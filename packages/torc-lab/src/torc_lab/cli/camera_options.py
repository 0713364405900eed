"""Which camera the commands of `torc camera` look through, and with which eyes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from torc import Conditions
from torc.registry.settings import Settings
from torc.specs.conditions import DEFAULT_WORKSPACE

if TYPE_CHECKING:
    from torc import Capture


@dataclass(frozen=True)
class CameraOptions:
    """The camera and what is made of its pictures. Settings: --camera.SETTING VALUE, e.g. --camera.serial 0123456789;
    docs/cameras.md lists them. Likewise --depth.SETTING and --perception.SETTING.
    """

    camera: str
    """Camera; `torc camera list` also says what is connected."""
    depth: str = "as-measured"
    """Depth: where the depth image comes from."""
    perception: str = "embedded"
    """Perception: what finds the objects."""
    workspace: str = DEFAULT_WORKSPACE
    """Whose camera pose counts with --camera.pose workspace: paper, or a workspace file of your own."""
    settings: Settings = field(default_factory=dict)
    """Settings of the stages, by dotted path."""

    def conditions(self) -> Conditions:
        """As the stages are made from them."""
        return Conditions(
            camera=self.camera,
            depth=self.depth,
            perception=self.perception,
            workspace=self.workspace,
            settings=self.settings,
        )


@contextmanager
def opened(conditions: Conditions) -> Iterator[Any]:
    """The camera, closed at the end of the block. Raises InputError."""
    from torc.registry.kinds import CAMERAS
    from torc_lab.cameras.kinds import open_camera

    camera = open_camera(conditions)
    try:
        yield camera
    finally:
        CAMERAS.traits(camera).close()


def snapshot(camera: Any) -> Capture:
    """One snapshot. Raises InputError, CameraError, PartError."""
    from torc.perception.checked_scenes import ask_camera

    return ask_camera(camera)
