"""The fixed part of the world: table, bin, camera, and the region that the occlusion volume covers.

World frame: x forward, y left, z up, z = 0 on the floor. The SDA10F's base is its origin; other robots stand elsewhere.
The paper's set-up is `data/paper.yaml`, which `torc.workspace.workspace_files.load_workspace` reads.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.geometry.transforms import Pose, intrinsics
from torc.records import VoxelGrid


@dataclass(frozen=True)
class Box:
    """An axis-aligned box: centre and full edge lengths, metres."""

    name: str
    center: tuple[float, float, float]
    size: tuple[float, float, float]


@dataclass(frozen=True)
class Bin:
    """An open bin beside the table, in metres.

    Attributes:
        center: centre of the floor's upper side, world frame.
        inner_size: inner length along x, along y, and height of the walls above the floor.
        wall_m: thickness of walls and floor.
    """

    center: tuple[float, float, float]
    inner_size: tuple[float, float, float]
    wall_m: float

    def boxes(self) -> tuple[Box, ...]:
        """Return floor and walls as boxes."""
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
    """The camera: an ideal pinhole, with its pose (OpenCV axes) and image size in pixels."""

    T_world_camera: Pose
    width: int
    height: int
    vertical_fov_rad: float

    @property
    def K(self) -> np.ndarray:
        """Intrinsics, pixels."""
        return intrinsics(self.width, self.height, self.vertical_fov_rad)


@dataclass(frozen=True)
class Room:
    """Where generated problems put their objects.

    Attributes:
        center, size: centre and lengths along x and y, metres, world frame.
        height_m: how high an object may be.
        open_above: objects can be dropped in from above (there is no roof).
    """

    center: tuple[float, float]
    size: tuple[float, float]
    height_m: float
    open_above: bool


@dataclass(frozen=True)
class Workspace:
    """Where the task takes place.

    Attributes:
        table: its board; the upper side is the support surface and the floor of the grid.
        bin: the bin.
        camera: the camera.
        grid: the watched region, which the occlusion volume covers.
        drop_position: the TCP's position when the gripper opens above the bin.
        obstacles: further fixed boxes.
        name: its name.
        source: fingerprint of the file.
        room: for generated problems; without one they use the middle of the paper's table.
    """

    table: Box
    bin: Bin
    camera: CameraMount
    grid: VoxelGrid
    drop_position: tuple[float, float, float]
    obstacles: tuple[Box, ...]
    name: str
    source: str
    room: Room | None = None

    @property
    def support_z_m(self) -> float:
        """Height of the support surface in the world."""
        return self.table.center[2] + self.table.size[2] / 2

    def static_boxes(self) -> tuple[Box, ...]:
        """Return all fixed obstacles: the table's board, the bin, and the other boxes."""
        return (self.table, *self.bin.boxes(), *self.obstacles)

    def watched_table(self, across: int) -> Float[np.ndarray, "n 3"]:
        """Return points of the region's floor that lie over the table, `across` along each side of the region."""
        low, high = self.grid.origin, self.grid.upper
        steps = (np.arange(across) + 0.5) / across
        x, y = np.meshgrid(*(low[i] + steps * (high[i] - low[i]) for i in (0, 1)))
        points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, self.support_z_m)])
        over = np.abs(points[:, :2] - np.array(self.table.center[:2])) <= np.array(self.table.size[:2]) / 2
        return points[over.all(axis=1)]
