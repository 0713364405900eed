"""Written against the documented interface; not yet run.

Free motions for `--motion curobo` by cuRobo 0.8 or later ("v2"; NVlabs/curobo). The import paths of its classes and the
form of its collision_cache are guesses: look at these first.

Install: a checkout with its extra cu12-torch or cu13-torch, an NVIDIA GPU newer than Turing, driver 580 or later; then
    pip install --no-deps -e PATH_TO_TORC -e PATH_TO_TORC/packages/torc-networks
    pip install pyzmq msgpack jaxtyping
(`curobo` and `nvidia-curobo` on the package index are placeholders.) The robot's files, made in torc's own environment:
    python packages/torc-networks/tools/curobo_robot.py sda10f_2f85 curobo_robot
Run:
    python packages/torc-networks/servers/curobo.py --robot curobo_robot/sda10f_2f85.yml
    torc run structured-03 --motion curobo
Licence: Apache-2.0 from 0.8.0 on; earlier versions are not for commercial use, and have the other sign in their voxels.
"""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from curobo.motion_planner import MotionPlanner, MotionPlannerCfg
from curobo.scene import Cuboid, SceneCfg, Sphere, VoxelGrid
from curobo.types import JointState

from torc_networks.fields import Fields, request
from torc_networks.server import serve

_MOST_BOXES = 64
_HELD = "attached_object"


def scene_of(fields: Fields, sizes: dict[str, Any]) -> SceneCfg:
    """The world of a request: signed distances at voxel centres (negative inside), and boxes."""
    esdf, size = fields.finite("esdf", (None, None, None)), fields.number("voxel_size")
    dims = [size * n for n in esdf.shape]
    if dims != sizes.setdefault("dims", dims):
        raise fields.refuse(f"the voxels are {dims} m; this server was first asked with {sizes['dims']} m.")
    values = torch.as_tensor(esdf.reshape(-1, 1), dtype=torch.float16, device="cuda")  # C order: x, y, z
    grid = VoxelGrid(
        name="clutter",
        pose=fields.finite("pose", (7,)).tolist(),
        dims=dims,
        voxel_size=size,
        feature_tensor=values,
    )
    boxes = [
        Cuboid(name=f"box_{k}", pose=[*((low + high) / 2).tolist(), 1, 0, 0, 0], dims=(high - low).tolist())
        for k, (low, high) in enumerate(fields.finite("boxes", (None, 6)).reshape(-1, 2, 3))
    ]
    return SceneCfg(voxel=[grid], cuboid=boxes)


def held_spheres(fields: Fields) -> list[Sphere]:
    """What is in the hand, where it is at the start of the motion."""
    T, spheres = fields.pose("T_world_tool0"), fields.finite("attached", (None, 4))
    centers = spheres[:, :3] @ T[:3, :3].T + T[:3, 3]
    return [
        Sphere(name=f"held_{k}", pose=[*c.tolist(), 1, 0, 0, 0], radius=float(r))
        for k, (c, r) in enumerate(zip(centers, spheres[:, 3], strict=True))
    ]


class Server:
    """The planner, made for the size of the first request's voxels."""

    def __init__(self, robot: Path) -> None:
        self.robot, self.sizes = robot, dict[str, Any]()
        self.planner: MotionPlanner | None = None

    def plan(self, asked: Mapping[str, Any]) -> Mapping[str, Any]:
        """The first goal to which a motion is found."""
        fields = request(asked)
        names = [str(n) for n in asked["joint_names"]]
        start = fields.finite("start", (len(names),))
        goals = fields.finite("goals", (None, len(names)))
        planner = self._with_world(scene_of(fields, self.sizes))
        state, held = self._state(start, names), held_spheres(fields)
        if held:
            planner.attachment_manager.attach(state, held, link_name=_HELD, num_spheres=len(held))
        try:
            for goal in goals:
                result = planner.plan_cspace(goal_state=self._state(goal, names), current_state=state)
                if result is not None and bool(result.success.all()):
                    path = (
                        result.get_interpolated_plan().position.reshape(-1, len(names)).float().cpu().numpy()
                    )
                    dt = float(planner.trajopt_solver.config.interpolation_dt)
                    return {"times": dt * np.arange(len(path)), "positions": path.astype(np.float64)}
        finally:
            if held:
                planner.attachment_manager.detach()
        return {"failure": f"cuRobo found no motion to any of {len(goals)} goals"}

    def _with_world(self, scene: SceneCfg) -> MotionPlanner:
        if self.planner is None:
            cache = {"voxel": {"layers": 1, "dims": self.sizes["dims"]}, "cuboid": _MOST_BOXES}
            config = MotionPlannerCfg.create(robot=str(self.robot), scene_model=scene, collision_cache=cache)
            self.planner = MotionPlanner(config)
            self.planner.warmup(enable_graph=True, num_warmup_iterations=5)
        self.planner.update_world(scene)
        return self.planner

    @staticmethod
    def _state(qpos: np.ndarray, names: list[str]) -> JointState:
        return JointState.from_position(
            torch.as_tensor(qpos[None], dtype=torch.float32, device="cuda"), names
        )


def main() -> None:
    """Serve `plan`."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", type=Path, required=True)
    parser.add_argument("--port", type=int, default=5558)
    options = parser.parse_args()
    serve({"plan": Server(options.robot).plan}, "cuRobo", options.port)


if __name__ == "__main__":
    main()
