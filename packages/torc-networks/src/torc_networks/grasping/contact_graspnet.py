"""The grasp planner `contact-graspnet`: candidates from a Contact-GraspNet server, for all objects at once."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float32, Int16

from torc.geometry.transforms import Pose, invert, transform_points
from torc.grasping.clouds import SceneClouds
from torc.grasping.geometric_planner import GeometricGraspPlanner, Proposals, Rngs
from torc.grasping.protocol import GraspScorer
from torc.records import BACKGROUND, SegmentedScene
from torc.robots.gripper import GripperDescription
from torc_networks.addresses import ServerConfig
from torc_networks.client import NetworkClient
from torc_networks.grasping.frames import measured_widths, tcp_of_contact_graspnet
from torc_networks.grasping.proposing import NetworkGraspConfig, most_confident, proposals, sent_points

_NEAR_M, _FAR_M = 0.2, 1.8
"""Of the surroundings, the range that Contact-GraspNet itself looks at."""


@dataclass(frozen=True)
class ContactGraspNetConfig(NetworkGraspConfig):
    """As NetworkGraspConfig."""

    server: ServerConfig = field(default_factory=lambda: ServerConfig("tcp://127.0.0.1:5557"))


class ContactGraspNetPlanner(GeometricGraspPlanner):
    """A network's candidates, torc's checks, torc's score."""

    generator_names = ("contact-graspnet",)

    def __init__(
        self,
        gripper: GripperDescription,
        support_z_m: float,
        config: ContactGraspNetConfig | None = None,
        scorer: GraspScorer | None = None,
    ) -> None:
        self.asked = ContactGraspNetConfig() if config is None else config
        super().__init__(gripper, support_z_m, self.asked, scorer)
        self.client = NetworkClient(self.asked.server)

    def propose(self, scene: SegmentedScene, clouds: SceneClouds, rngs: Rngs) -> Mapping[int, Proposals]:
        """The server's grasps of all objects. Raises NetworkError."""
        if not clouds.objects:
            return {}
        T_world_camera = np.asarray(scene.observation.T_world_camera, float)
        in_camera, ids = self._scene_points(scene, invert(T_world_camera))
        seed = int(rngs[clouds.objects[0].id].integers(1 << 31))
        found = self.client.grasps(in_camera, ids, T_world_camera=T_world_camera, seed=seed)
        owners = np.zeros(0, np.int64) if found.object_ids is None else found.object_ids
        if unknown := sorted(set(owners.tolist()) - set(scene.ids)):
            why = f"it has grasps for objects {unknown}, and was asked for {list(scene.ids)}."
            raise self.client.unusable("grasps", why)
        Ts = tcp_of_contact_graspnet(found.Ts, T_world_camera)
        out = {}
        for cloud in clouds.objects:
            own = np.flatnonzero(owners == cloud.id)
            own = own[most_confident(found.confidences[own], self.asked.max_grasps)]
            told = found.widths_m[own]
            widths = np.where(np.isnan(told), measured_widths(Ts[own], cloud.points, self.hand), told)
            out[cloud.id] = proposals(Ts[own], widths, found.confidences[own], self.hand, self.asked.score)
        return out

    def _scene_points(
        self, scene: SegmentedScene, T_camera_world: Pose
    ) -> tuple[Float32[np.ndarray, "n 3"], Int16[np.ndarray, "n"]]:
        """All objects and what is around them, camera frame, and whose each point is; BACKGROUND for the table."""
        parts = {o.id: transform_points(T_camera_world, o.points.astype(float)) for o in scene.objects}
        around = transform_points(T_camera_world, scene.background_points.astype(float))
        parts[BACKGROUND] = around[(around[:, 2] > _NEAR_M) & (around[:, 2] < _FAR_M)]
        sent = {k: sent_points(p.astype(np.float32), self.asked.max_points) for k, p in parts.items()}
        ids = np.concatenate([np.full(len(p), k, np.int16) for k, p in sent.items()])
        return np.concatenate([*sent.values()]), ids
