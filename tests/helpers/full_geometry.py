"""The robot's collision primitives, as its MJCF has them, against voxels and boxes: exact, by coal, and slow.

Shares nothing with `torc.collision`: no spheres, no distance field, no forward kinematics of ours.
"""

from collections.abc import Sequence
from typing import Any

import coal
import mujoco
import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull

from torc.robots.description import RobotDescription
from torc.workspace.description import Box

_IDENTITY = coal.Transform3s.Identity()
Obstacle = tuple[Any, Any]
"""A shape of coal and its pose in the world."""


class FullGeometry:
    """Shapes of a robot at any configuration.

    Attributes:
        links: per shape the link it belongs to, counted as in SphereModel.link, the fingers as part of the gripper;
            -1 for parts that do not move.
    """

    def __init__(self, robot: RobotDescription, shrink_gripper_m: float = 0.0) -> None:
        """shrink_gripper_m: by how much the gripper's shapes are made smaller on all sides."""
        self._robot = robot
        self._model = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
        self._data = mujoco.MjData(self._model)
        self._arm = [self._model.joint(name).qposadr[0] for name in robot.arm.joint_names]
        self._gripper = [self._model.joint(name).qposadr[0] for name in robot.gripper.joint_names]
        self._geoms = [g for g in range(self._model.ngeom) if self._model.geom_contype[g] != 0]
        self.links = np.array([self._link(g) for g in self._geoms])
        dof = robot.arm.dof
        shrink = np.where(self.links == dof, shrink_gripper_m, 0.0)
        self._shapes = [_shape(self._model, g, float(s)) for g, s in zip(self._geoms, shrink)]

    def name(self, i: int) -> str:
        """What the MJCF calls shape i."""
        return self._model.geom(self._geoms[i]).name

    def place(self, qpos: Float[np.ndarray, "dof"], width_m: float) -> list[Any]:
        """World poses of all shapes."""
        self._data.qpos[self._arm] = qpos
        self._data.qpos[self._gripper] = self._robot.gripper.qpos(width_m)
        mujoco.mj_kinematics(self._model, self._data)
        return [
            coal.Transform3s(self._data.geom_xmat[g].reshape(3, 3), self._data.geom_xpos[g])
            for g in self._geoms
        ]

    def touching(
        self,
        poses: Sequence[Any],
        obstacles: Sequence[Obstacle],
        moving: np.ndarray,
    ) -> list[int]:
        """Which of the given shapes touch one of the obstacles."""
        return [int(i) for i in moving if any(_touch(self._shapes[i], poses[i], *o) for o in obstacles)]

    def self_contacts(self, poses: Sequence[Any]) -> list[tuple[int, int]]:
        """Pairs of shapes that touch, among the links that can."""
        gripper = self._robot.arm.dof
        pairs = {(min(int(a), gripper), min(int(b), gripper)) for a, b in self._robot.self_pairs}
        pairs |= {(min(int(a), gripper), -1) for a in self._robot.static_links}
        out = []
        for i, a in enumerate(self.links):
            for j, b in enumerate(self.links):
                if (a, b) in pairs and _touch(self._shapes[i], poses[i], self._shapes[j], poses[j]):
                    out.append((i, j))
        return out

    def distance_to_points(
        self, poses: Sequence[Any], moving: np.ndarray, points: Float[np.ndarray, "n 3"]
    ) -> Float[np.ndarray, "n"]:
        """Distance from each point to the nearest of the given shapes' bounding boxes or capsules; 0 within one."""
        nearest = np.full(len(points), np.inf)
        for i in moving:
            local = (points - poses[i].getTranslation()) @ poses[i].getRotation()
            size, kind = self._model.geom_size[self._geoms[i]], self._model.geom_type[self._geoms[i]]
            if kind == mujoco.mjtGeom.mjGEOM_BOX:
                gap = np.linalg.norm(np.maximum(np.abs(local) - size, 0.0), axis=1)
            else:
                half = size[1] if kind != mujoco.mjtGeom.mjGEOM_SPHERE else 0.0
                local[:, 2] -= np.clip(local[:, 2], -half, half)
                gap = np.maximum(np.linalg.norm(local, axis=1) - size[0], 0.0)
            nearest = np.minimum(nearest, gap)
        return nearest

    def _link(self, geom: int) -> int:
        body = self._model.geom_bodyid[geom]
        joints = {int(self._model.joint(n).bodyid[0]): i for i, n in enumerate(self._robot.arm.joint_names)}
        while body != 0:
            if self._model.body(body).name == self._robot.gripper_body_name:
                return self._robot.arm.dof
            if int(body) in joints:
                return joints[int(body)]
            body = self._model.body_parentid[body]
        return -1


def voxel_octree(centers: Float[np.ndarray, "n 3"], voxel_size_m: float) -> list[Obstacle]:
    """Voxels as solid cubes: one obstacle, or none where there are no voxels.

    An octree's cubes sit at multiples of the voxel size: the grid's origin must be such a multiple.
    """
    if len(centers) == 0:
        return []
    return [(coal.makeOctree(np.ascontiguousarray(centers, dtype=float), voxel_size_m), _IDENTITY)]


def convex_hull(points: Float[np.ndarray, "n 3"]) -> Any:
    """The solid convex hull of at least four points; flat ones are given a hair of thickness."""
    hull = ConvexHull(np.asarray(points, dtype=float), qhull_options="QJ")
    position = np.full(len(points), -1)
    position[hull.vertices] = np.arange(len(hull.vertices))
    vertices, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for p in hull.points[hull.vertices]:
        vertices.append(p)
    for corners in position[hull.simplices].tolist():
        triangles.append(coal.Triangle(*corners))
    return coal.Convex(vertices, triangles)


def solid_boxes(boxes: Sequence[Box]) -> list[Obstacle]:
    """Fixed boxes."""
    return [(coal.Box(*box.size), coal.Transform3s(np.eye(3), np.asarray(box.center))) for box in boxes]


def _touch(a: Any, pose_a: Any, b: Any, pose_b: Any) -> bool:
    return coal.collide(a, pose_a, b, pose_b, coal.CollisionRequest(), coal.CollisionResult()) > 0


def _shape(model: mujoco.MjModel, geom: int, shrink_m: float) -> Any:
    size, kind = model.geom_size[geom], model.geom_type[geom]
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return coal.Sphere(size[0] - shrink_m)
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return coal.Capsule(size[0] - shrink_m, 2 * size[1])
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return coal.Cylinder(size[0] - shrink_m, 2 * (size[1] - shrink_m))
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return coal.Box(*(2 * np.maximum(size - shrink_m, 1e-4)))
    raise NotImplementedError(f"Geom '{model.geom(geom).name}' is no sphere, capsule, cylinder or box.")
