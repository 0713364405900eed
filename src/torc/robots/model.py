"""A compiled MJCF with look-ups whose errors say what is missing."""

from itertools import product
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.geometry.transforms import Pose, make_pose
from torc.robots.schema import RobotFile


class Model:
    """A robot file (`path` for messages), its MJCF, compiled alone, and one state of that."""

    def __init__(self, path: Path, entry: RobotFile, m: Any) -> None:
        self.path, self.entry, self.m, self.d = path, entry, m, mujoco.MjData(m)

    def id(self, kind: str, name: str) -> int:
        """Return the id of a named body, joint, geom, site or actuator. Raises InputError."""
        number = mujoco.mj_name2id(self.m, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), name)
        if number < 0:
            raise InputError(f"{self.path} names the {kind} '{name}', which its MJCF does not have.")
        return int(number)

    def place(self, qpos: dict[int, float]) -> None:
        """Set joints by id, all others to 0, and compute all poses."""
        self.d.qpos[:] = 0.0
        for joint, q in qpos.items():
            self.d.qpos[self.m.jnt_qposadr[joint]] = q
        mujoco.mj_kinematics(self.m, self.d)
        mujoco.mj_comPos(self.m, self.d)
        mujoco.mj_tendon(self.m, self.d)
        mujoco.mj_transmission(self.m, self.d)

    def joint_pose(self, joint: int) -> Pose:
        """Return the world pose of a joint's frame: its body's axes, at its anchor; moves with the body."""
        body = int(self.m.jnt_bodyid[joint])
        return self.body_pose(body) @ make_pose(p=self.m.jnt_pos[joint])

    def body_pose(self, body: int) -> Pose:
        """Return the world pose of a body."""
        return make_pose(self.d.xmat[body].reshape(3, 3), self.d.xpos[body])

    def geom_pose(self, geom: int) -> Pose:
        """Return the world pose of a geom."""
        return make_pose(self.d.geom_xmat[geom].reshape(3, 3), self.d.geom_xpos[geom])

    def site_pose(self, name: str) -> Pose:
        """Return the world pose of a named site. Raises InputError."""
        site = self.id("site", name)
        return make_pose(self.d.site_xmat[site].reshape(3, 3), self.d.site_xpos[site])

    def ancestors(self, body: int, stop: int = 0) -> list[int]:
        """Return the body and its parents, up to and without `stop` (or the world)."""
        out = []
        while body not in (0, stop):
            out.append(body)
            body = int(self.m.body_parentid[body])
        return out

    def subtree(self, body: int) -> list[int]:
        """Return the body and all below it."""
        return [b for b in range(1, self.m.nbody) if body in self.ancestors(b)]

    def collision_geoms(self, body: int) -> list[int]:
        """Return ids of the body's geoms that can collide."""
        first, count = int(self.m.body_geomadr[body]), int(self.m.body_geomnum[body])
        collides = self.m.geom_contype | self.m.geom_conaffinity
        return [g for g in range(first, first + count) if collides[g]]

    def kind(self, geom: int) -> str:
        """Return a geom's type, e.g. 'capsule'."""
        return mujoco.mjtGeom(int(self.m.geom_type[geom])).name.removeprefix("mjGEOM_").lower()

    def box_corners(self, geom: int) -> Float[np.ndarray, "8 3"]:
        """Return world corners of a geom's bounding box (aligned with the geom)."""
        center, half = self.m.geom_aabb[geom, :3], self.m.geom_aabb[geom, 3:]
        local = center + np.array(list(product((-1, 1), repeat=3))) * half
        return local @ self.d.geom_xmat[geom].reshape(3, 3).T + self.d.geom_xpos[geom]
