"""The fixed part of the world: table, bin, camera, and the region that the occlusion volume covers.

Geometry of the paper's set-up: shoulders 1.20 m above the floor, table top at z = 1.05 m, one camera on the torso
at (.10, 0, 1.38) m. World frame = robot base: x forward, y left, z up, z = 0 on the floor.
"""

from dataclasses import dataclass, field

import numpy as np

from torc.geometry.projection import intrinsics
from torc.geometry.transforms import Pose, look_at
from torc.records import VoxelGrid


@dataclass(frozen=True)
class Box:
    """An axis-aligned box: centre and full edge lengths, metres."""

    name: str
    center: tuple[float, float, float]
    size: tuple[float, float, float]


@dataclass(frozen=True)
class Bin:
    """An open bin beside the table.

    Attributes:
        center: centre of its floor's upper side, metres.
        inner_size: inner length along x, along y, and height of the walls above the floor.
        wall_m: thickness of walls and floor.
    """

    center: tuple[float, float, float] = (0.24, -0.88, 0.60)
    inner_size: tuple[float, float, float] = (0.36, 0.34, 0.34)
    wall_m: float = 0.02

    def boxes(self) -> tuple[Box, ...]:
        """Floor and walls."""
        (cx, cy, cz), (lx, ly, h), w = self.center, self.inner_size, self.wall_m
        z = cz + h / 2
        return (
            Box("bin_floor", (cx, cy, cz - w), (lx + 2 * w, ly + 2 * w, 2 * w)),
            Box("bin_front", (cx - lx / 2 - w / 2, cy, z), (w, ly + 2 * w, h)),
            Box("bin_back", (cx + lx / 2 + w / 2, cy, z), (w, ly + 2 * w, h)),
            Box("bin_left", (cx, cy + ly / 2 + w / 2, z), (lx, w, h)),
            Box("bin_right", (cx, cy - ly / 2 - w / 2, z), (lx, w, h)),
        )


@dataclass(frozen=True)
class CameraMount:
    """The torso camera: ideal pinhole.

    Attributes:
        T_world_camera: pose, OpenCV frame.
        width, height: image size, pixels.
        vertical_fov_rad: vertical field of view.
    """

    T_world_camera: Pose = field(default_factory=lambda: look_at((0.10, 0.0, 1.38), (0.65, 0.0, 1.11)))
    width: int = 640
    height: int = 480
    vertical_fov_rad: float = float(np.deg2rad(80.0))

    @property
    def K(self) -> np.ndarray:
        """Intrinsics, pixels."""
        return intrinsics(self.width, self.height, self.vertical_fov_rad)


def _default_grid() -> VoxelGrid:
    return VoxelGrid(np.array([0.42, -0.62, 1.05]), 0.01, (60, 102, 42))


@dataclass(frozen=True)
class Workspace:
    """Where the task takes place.

    Attributes:
        table: the table's board; its upper side is the support surface.
        bin: where picked objects go.
        camera: the one camera.
        grid: the region the occlusion volume covers; its floor is the support surface.
        drop_position: TCP position above the bin at which the gripper opens.
        obstacles: further boxes that are always there.
        name: of the set-up.
        source: fingerprint of the file that it was read from; "" if none was.
    """

    table: Box = Box("table", (0.76, -0.06, 1.00), (0.68, 1.24, 0.10))
    bin: Bin = Bin()
    camera: CameraMount = field(default_factory=CameraMount)
    grid: VoxelGrid = field(default_factory=_default_grid)
    drop_position: tuple[float, float, float] = (0.26, -0.84, 1.12)
    obstacles: tuple[Box, ...] = ()
    name: str = "paper"
    source: str = ""

    @property
    def support_z_m(self) -> float:
        """Height of the support surface."""
        return self.table.center[2] + self.table.size[2] / 2

    def static_boxes(self) -> tuple[Box, ...]:
        """All fixed obstacles: the table's board, the bin, and what else stands there."""
        return (self.table, *self.bin.boxes(), *self.obstacles)
