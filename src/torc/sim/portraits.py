"""Draw single objects, each alone on the table, as portraits that fill the picture, and robots; check that objects
stand.
"""

import sys
from functools import lru_cache

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image

from torc.errors import TorcError
from torc.geometry.extent import Extent, extent
from torc.geometry.transforms import Pose, look_at, make_pose, rotation_about, rotation_from_wxyz
from torc.objects.library import load_object
from torc.objects.models import ObjectModel
from torc.problems.problem import ObjectPlacement, Problem
from torc.records import TARGET_ID
from torc.robots.description import RobotDescription
from torc.sim.gl import gl_backend
from torc.sim.rendering import CameraRenderer
from torc.sim.settling import run
from torc.sim.simulated_world import World, build_world
from torc.sim.spec import COLLISION_GROUP, VISUAL_GROUP, WorldConfig
from torc.workspace.description import CameraMount, Workspace
from torc.workspace.workspace_files import load_workspace

_FOV_RAD = 0.5
_AZIMUTH_RAD = (0.18, 0.06)
"""How far the camera stands to the right of the front: of a box, to show its side, and of other things, whose labels go
around them.
"""
_FILL = 0.86
"""Share of the picture that the object fills."""
_SUPERSAMPLING = 2
_SHADOW_REACH_M = 0.4
_STEADY_RAD, _STEADY_M = float(np.deg2rad(8.0)), 0.02
_ROBOT_EYE_M, _ROBOT_FOV_RAD = (1.6, -2.0, 1.3), 0.85
"""Position of the camera, relative to the middle between the table and the robot's base."""


def portrait(model: ObjectModel, width: int = 300, height: int = 250) -> UInt8[np.ndarray, "h w 3"]:
    """Draw the object in its natural pose on the table, as the simulator does.

    Raises InputError for a model that MuJoCo does not accept.
    """
    world = _alone(model, config=WorldConfig(shadow_size=2048))
    # The shadow map covers the object's surroundings alone: sharp edges, no speckles.
    light = world.model.light("key_light")
    light.pos[:] = _standing_at(model, world.workspace) - 2.0 * light.dir
    world.model.vis.map.shadowclip = _SHADOW_REACH_M / world.model.stat.extent
    mount = portrait_camera(model, _SUPERSAMPLING * width, _SUPERSAMPLING * height)
    with CameraRenderer(world, mount) as renderer:
        large = renderer.render_color()
    return np.asarray(Image.fromarray(large).resize((width, height), Image.Resampling.BOX))


def turn_table(
    model: ObjectModel, sides: int = 4, side_px: int = 200
) -> tuple[UInt8[np.ndarray, "h w 4"], ...]:
    """Draw the object in its natural pose from all around, RGBA: the fourth channel is 255 where it shows, 0 elsewhere.

    Raises as `portrait`.
    """
    world = _alone(model)
    center = _standing_at(model, world.workspace)
    mount = portrait_camera(model, side_px, side_px)
    pictures = []
    with CameraRenderer(world, mount) as renderer:
        for turn in np.linspace(0, 2 * np.pi, sides, endpoint=False):
            view = renderer.render(turned_about(mount, center, float(turn)))
            alpha = np.where(view.label_image == TARGET_ID, 255, 0).astype(np.uint8)
            pictures.append(np.dstack([view.rgb, alpha]))
    return tuple(pictures)


def draw_one() -> None:
    """Draw one object, and print the backend used; exit with the reason if that fails."""
    try:
        (picture,) = turn_table(load_object("mug_red"), sides=1)
        backend = gl_backend()
    except TorcError as error:
        sys.exit(str(error))
    shown = picture[picture[..., 3] > 0, :3]
    if len(shown) == 0 or np.ptp(shown) < 10:
        sys.exit("the picture is empty")
    print(backend)


@lru_cache(maxsize=64)
def size_by_ruler(model: ObjectModel) -> Extent:
    """Return the size of the object as a ruler measures it."""
    return extent(np.concatenate([mesh.vertices for mesh in model.visuals]))


def turned_about(mount: CameraMount, center: Float[np.ndarray, "3"], angle_rad: float) -> Pose:
    """Return the camera's pose after it moved round a vertical axis through a point."""
    R = rotation_about((0, 0, 1), angle_rad)
    T = mount.T_world_camera
    return make_pose(R @ T[:3, :3], center + R @ (T[:3, 3] - center))


def stands(model: ObjectModel) -> bool:
    """Check whether the object, set 1 mm above the table, neither falls over nor rolls away within a second.

    Raises InputError if MuJoCo does not accept it, and PhysicsError.
    """
    world = _alone(model, above_m=0.001)
    before = world.positions[0]
    run(world, 1.0)
    up = rotation_from_wxyz(world.wxyz[0])[2, 2]
    moved_m = float(np.linalg.norm(world.positions[0, :2] - before[:2]))
    return bool(np.arccos(np.clip(up, -1.0, 1.0)) < _STEADY_RAD and moved_m < _STEADY_M)


def portrait_camera(model: ObjectModel, width: int, height: int) -> CameraMount:
    """Return the camera of a portrait: in front of the object, slightly to the right; higher for flatter objects."""
    depth, breadth, tall = model.size_m
    elevation = np.interp(tall / max(depth, breadth), [0.1, 0.6, 1.5], [0.95, 0.70, 0.45])
    azimuth = _AZIMUTH_RAD[0 if model.pieces[0].kind == "box" else 1]
    c, s = np.cos(azimuth), np.sin(azimuth)
    toward = np.array([-c * np.cos(elevation), -s * np.cos(elevation), np.sin(elevation)])
    right = np.array([s, -c, 0.0])
    up = np.cross(right, -toward)
    points = np.concatenate([mesh.vertices for mesh in model.visuals])
    half_height = np.tan(_FOV_RAD / 2) * _FILL
    half_width = half_height * width / height
    # How far away the camera must be for each point to be within the picture, vertically and horizontally.
    nearer = points @ toward
    needs = [np.abs(points @ up) / half_height + nearer, np.abs(points @ right) / half_width + nearer]
    center = _standing_at(model, load_workspace())
    return CameraMount(look_at(center + np.max(needs) * toward, center), width, height, _FOV_RAD)


def robot_portrait(robot: RobotDescription, workspace: Workspace) -> UInt8[np.ndarray, "h w 3"]:
    """Draw the robot as simulated, with a mug on the table for scale.

    A robot without visible geoms shows its collision geoms. Raises InputError if the simulator does not accept the two
    together.
    """
    mug = load_object("mug_red")
    world = _alone(mug, robot=robot, workspace=workspace)
    model, roots = world.model, [world.model.body(name).id for name in robot.root_body_names]
    own = np.isin(model.body_rootid[model.geom_bodyid], roots)
    if not (own & (model.geom_group < COLLISION_GROUP)).any():
        model.geom_group[own & (model.geom_group == COLLISION_GROUP)] = VISUAL_GROUP
    middle = (_standing_at(mug, workspace) + robot.arm.T_world_base[:3, 3]) / 2
    mount = CameraMount(look_at(middle + np.array(_ROBOT_EYE_M), middle), 960, 720, _ROBOT_FOV_RAD)
    with CameraRenderer(world, mount) as renderer:
        return renderer.render_color()


def _alone(
    model: ObjectModel,
    above_m: float = 0.0,
    config: WorldConfig | None = None,
    robot: RobotDescription | None = None,
    workspace: Workspace | None = None,
) -> World:
    """Build a world with the object in its natural pose in the middle of the table, or a little above it."""
    workspace = workspace or load_workspace()
    x, y, z = (float(v) for v in _standing_at(model, workspace))
    placement = ObjectPlacement("thing", model.name, (x, y, z + above_m), (1.0, 0.0, 0.0, 0.0))
    problem = Problem("alone", "structured", "", "thing", (placement,))
    return build_world(problem, robot, workspace, config, load_model=lambda _: model)


def _standing_at(model: ObjectModel, workspace: Workspace) -> Float[np.ndarray, "3"]:
    """Return the position of the object's frame in the middle of the table."""
    x, y, _ = workspace.table.center
    return np.array([x, y, workspace.support_z_m + model.size_m[2] / 2])
