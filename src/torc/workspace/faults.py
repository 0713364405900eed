"""Find mistakes in a workspace: a camera that sees none of the table, and impossible places."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from torc.geometry.transforms import project
from torc.workspace.description import Box, Workspace

_ACROSS = 21
_LEAST_SEEN = 0.05
"""Least share of the region's floor over the table that the camera must see."""
_FARTHEST_M = 8.0


def faults(workspace: Workspace) -> list[str]:
    """Return the faults of a workspace, each with the fields concerned."""
    return [*_camera_faults(workspace), *_place_faults(workspace)]


def _camera_faults(workspace: Workspace) -> Iterator[str]:
    eye = workspace.camera.T_world_camera[:3, 3]
    around = next((box.name for box in _solids(workspace) if _inside(eye, box)), None)
    if around is not None:
        yield f"camera.position: the camera is inside '{around}'; move it out"
        return
    if eye[2] <= workspace.support_z_m:
        yield (
            f"camera.position: the camera is at z = {eye[2]:.2f} m, below the table's upper side at "
            f"{workspace.support_z_m:.2f} m; raise it"
        )
        return
    floor = watched_table(workspace, _ACROSS)
    if len(floor) == 0:
        yield "region: no part of it lies over the table; check region.origin and table.center"
        return
    seen, distance_m = _seen(workspace, floor)
    if distance_m > _FARTHEST_M:
        yield f"camera.position: the camera is {distance_m:.1f} m from the table. Are these metres?"
    elif seen < _LEAST_SEEN:
        yield (
            f"camera: it sees {seen:.0%} of the watched part of the table. Check camera.position, look_at (or "
            "T_world_camera: OpenCV axes, z forward) and vertical_fov_deg"
        )


def _place_faults(workspace: Workspace) -> Iterator[str]:
    (x, y, z), bin_ = workspace.drop_position, workspace.bin
    (cx, cy, cz), (lx, ly, h) = bin_.center, bin_.inner_size
    if abs(x - cx) > lx / 2 or abs(y - cy) > ly / 2 or z < cz + h:
        yield "bin.drop_position: it is not above the bin's opening"
    room = workspace.room
    if room is not None:
        low, high = workspace.grid.origin[:2], workspace.grid.upper[:2]
        center, half = np.array(room.center), np.array(room.size) / 2
        if (center + half < low).any() or (center - half > high).any():
            yield "room: no part of it lies in the region; check room.center and room.size"


def _solids(workspace: Workspace) -> Iterator[Box]:
    """Yield the boxes where no camera can be: table, bin with its content, and obstacles."""
    yield from workspace.static_boxes()
    (x, y, z), size = workspace.bin.center, workspace.bin.inner_size
    yield Box("bin", (x, y, z + size[2] / 2), size)


def _inside(point: np.ndarray, box: Box) -> bool:
    return bool((np.abs(point - np.array(box.center)) < np.array(box.size) / 2).all())


def watched_table(workspace: Workspace, across: int) -> Float[np.ndarray, "n 3"]:
    """Return points of the region's floor that lie over the table, `across` along each side of the region."""
    low, high, table = workspace.grid.origin, workspace.grid.upper, workspace.table
    steps = (np.arange(across) + 0.5) / across
    x, y = np.meshgrid(*(low[i] + steps * (high[i] - low[i]) for i in (0, 1)))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, workspace.support_z_m)])
    over = np.abs(points[:, :2] - np.array(table.center[:2])) <= np.array(table.size[:2]) / 2
    return points[over.all(axis=1)]


def _seen(workspace: Workspace, points: np.ndarray) -> tuple[float, float]:
    """Return the share of the points in the camera's picture, and the camera's distance from the nearest, metres."""
    camera = workspace.camera
    u, v, depth_m = project(points, camera.K, camera.T_world_camera)
    inside = (depth_m > 0) & (u > -0.5) & (u < camera.width - 0.5) & (v > -0.5) & (v < camera.height - 0.5)
    distances_m = np.linalg.norm(points - camera.T_world_camera[:3, 3], axis=1)
    return float(inside.mean()), float(distances_m.min())
