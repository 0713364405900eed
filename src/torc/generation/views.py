"""Pictures of a problem for people: as the robot sees it, from the front, from the side and from the top."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, get_args

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from torc.drawing.palette import object_color
from torc.geometry.transforms import Pose, look_at, rotation_from_wxyz
from torc.problems.problem import Problem
from torc.records import TARGET_ID
from torc.sim.rendering import CameraRenderer, View
from torc.sim.simulated_world import Presence, World, build_world
from torc.sim.state import restore_state, save_state
from torc.specs.conditions import DEFAULT_WORKSPACE
from torc.workspace.description import CameraMount, Workspace
from torc.workspace.workspace_files import load_workspace

ViewName = Literal["robot", "front", "side", "top"]
VIEW_NAMES: tuple[ViewName, ...] = get_args(ViewName)
_WHITE = (255, 255, 255)
_FILL = 0.84
"""Share of the picture, from its middle to its rim, that the clutter may take."""
_SIDE_FROM = (-0.15, -1.0, 0.45)
"""Direction from the clutter to the eye of the side view, world."""
_DASH = 3.5
"""Length of a dash, as a multiple of the outline's thickness."""


@dataclass(frozen=True)
class ViewConfig:
    """Size and outline of the pictures, pixels, and the field of view of all cameras but the robot's."""

    width: int = 480
    height: int = 360
    vertical_fov_rad: float = 0.7
    outline_px: int = 2


def problem_views(
    problem: Problem, workspace: Workspace | None = None, config: ViewConfig | None = None
) -> dict[ViewName, View]:
    """Draw the view of the robot's camera, and nearer views without further boxes of the workspace.

    These are from the front, from the side (the robot's right) and from the top (the robot below). The whole target is
    outlined in the colour images: solid where it is in sight, dashed where something hides it.
    """
    workspace = workspace or load_workspace(problem.workspace or DEFAULT_WORKSPACE)
    config = config or ViewConfig()
    world = build_world(problem, None, workspace)
    near = _near_poses(world, workspace, config)
    # Walls and roofs would hide the objects among them from the side and from above.
    bare = build_world(replace(problem, workspace=""), None, replace(workspace, obstacles=()))
    own = replace(workspace.camera, width=config.width, height=config.height)
    mount = CameraMount(near["front"], config.width, config.height, config.vertical_fov_rad)
    views = _render(world, own, {"robot": own.T_world_camera}, config) | _render(bare, mount, near, config)
    return {name: views[name] for name in VIEW_NAMES}


def _render(
    world: World, mount: CameraMount, poses: Mapping[ViewName, Pose], config: ViewConfig
) -> dict[ViewName, View]:
    """Render the views of one camera from some poses."""
    state = save_state(world)
    with CameraRenderer(world, mount) as renderer:
        views = {name: renderer.render(pose) for name, pose in poses.items()}
        for other in range(world.object_count):
            if other != TARGET_ID:
                world.park(other, Presence.DROPPED)
        for name, view in views.items():
            whole = renderer.render(poses[name], color=False).label_image == TARGET_ID
            rgb = _outlined(view.rgb, whole, view.label_image == TARGET_ID, config.outline_px)
            views[name] = replace(view, rgb=rgb)
        restore_state(world, state)
    return views


def _near_poses(world: World, workspace: Workspace, config: ViewConfig) -> dict[ViewName, Pose]:
    """Return cameras as near as possible with all of the clutter in the picture."""
    points = np.concatenate(
        [
            mesh.vertices @ rotation_from_wxyz(wxyz).T + position
            for model, position, wxyz, there in zip(world.models, world.positions, world.wxyz, world.present)
            if there
            for mesh in model.visuals
        ]
    )
    eye = workspace.camera.T_world_camera[:3, 3]
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    return {
        "front": _fitting(points, eye - middle, config),
        "side": _fitting(points, np.array(_SIDE_FROM), config),
        # A hair off the vertical, so that the top view has the robot below.
        "top": _fitting(points, np.array([-1e-3, 0.0, 1.0]), config),
    }


def _fitting(points: Float[np.ndarray, "n 3"], way: Float[np.ndarray, "3"], config: ViewConfig) -> Pose:
    """Return the nearest camera that looks against a direction and has all points in the picture, with a margin."""
    pose = look_at(way, np.zeros(3))
    across, down, along = (points @ pose[:3, :3]).T
    slope_down = _FILL * np.tan(config.vertical_fov_rad / 2)
    slope_across = slope_down * config.width / config.height
    # A point is in the picture if |across - x| <= slope (along - z), and so on: two half-planes for each direction.
    x, z_across = _apex(across, along, slope_across)
    y, z_down = _apex(down, along, slope_down)
    pose[:3, 3] = pose[:3, :3] @ [x, y, min(z_across, z_down)]
    return pose


def _apex(across: Float[np.ndarray, "n"], along: Float[np.ndarray, "n"], slope: float) -> tuple[float, float]:
    """Return the tip of the narrowest wedge of that slope around some points: its across and along."""
    highest, lowest = float((across - slope * along).max()), float((across + slope * along).min())
    return (highest + lowest) / 2, (lowest - highest) / (2 * slope)


def _outlined(
    image: UInt8[np.ndarray, "h w 3"],
    whole: Bool[np.ndarray, "h w"],
    seen: Bool[np.ndarray, "h w"],
    thickness: int,
) -> UInt8[np.ndarray, "h w 3"]:
    """Outline a mask: solid near its visible part, dashed elsewhere."""
    image = image.copy()
    near = cv2.dilate(seen.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    contours, _ = cv2.findContours(whole.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    dash = round(_DASH * thickness)
    for color, width in ((_WHITE, 2 * thickness), (object_color(TARGET_ID), thickness)):
        for contour in contours:
            points = contour[:, 0]
            for i, (a, b) in enumerate(zip(points, np.roll(points, -1, axis=0))):
                if near[a[1], a[0]] or i // dash % 2 == 0:
                    cv2.line(image, a.tolist(), b.tolist(), color, width)
    return image
