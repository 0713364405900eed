"""The grasp planner `graspgenx`: candidates from a GraspGen or GraspGenX server, one object at a time."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.grasping.clouds import ObjectCloud, SceneClouds
from torc.grasping.geometric_planner import GeometricGraspPlanner, Proposals, Rngs
from torc.grasping.protocol import GraspScorer
from torc.records import SegmentedScene
from torc.robots.gripper import GripperDescription
from torc_networks.answers import Grasps
from torc_networks.client import NetworkClient
from torc_networks.grasping.frames import along_axes, fingertips, gripper_config, measured_widths
from torc_networks.grasping.proposing import NetworkGraspConfig, most_confident, proposals, sent_points

_ROUNDS = 3


@dataclass(frozen=True)
class GraspGenXConfig(NetworkGraspConfig):
    """What the server is asked.

    Attributes:
        num_grasps, topk_num_grasps, grasp_threshold, min_grasps, max_tries, remove_outliers: as GraspGen's server takes
            them.
        describe: send torc's description of the gripper and a seed. A server that was started for one gripper, as
            NVIDIA's are, looks at neither.
        gripper_type: kind of gripper in that description: parallel_2f or revolute_2f.
        fingertip_m: where the TCP is in the frame of the gripper that the server knows by itself; None: as torc knows
            it, for the opening that the object leaves.
    """

    num_grasps: int = 200
    topk_num_grasps: int = 100
    grasp_threshold: float = -1.0
    min_grasps: int = 40
    max_tries: int = 6
    remove_outliers: bool = True
    describe: bool = True
    gripper_type: str = "parallel_2f"
    fingertip_m: tuple[float, float, float] | None = None


class GraspGenXPlanner(GeometricGraspPlanner):
    """A network's candidates, torc's checks, torc's score."""

    generator_names = ("graspgenx",)

    def __init__(
        self,
        gripper: GripperDescription,
        support_z_m: float,
        config: GraspGenXConfig | None = None,
        scorer: GraspScorer | None = None,
    ) -> None:
        self.asked = GraspGenXConfig() if config is None else config
        super().__init__(gripper, support_z_m, self.asked, scorer)
        self.gripper, self.client = gripper, NetworkClient(self.asked.server)

    def propose(self, scene: SegmentedScene, clouds: SceneClouds, rngs: Rngs) -> Mapping[int, Proposals]:
        """The server's grasps of each object. Raises NetworkError."""
        return {
            cloud.id: self._asked_for(scene.object(cloud.id).points, cloud, rngs[cloud.id])
            for cloud in clouds.objects
        }

    def _asked_for(self, points: np.ndarray, cloud: ObjectCloud, rng: np.random.Generator) -> Proposals:
        config, more = self.asked, {}
        names = (
            "num_grasps",
            "topk_num_grasps",
            "grasp_threshold",
            "min_grasps",
            "max_tries",
            "remove_outliers",
        )
        if config.describe:
            more = {
                "gripper": gripper_config(self.gripper, config.gripper_type),
                "seed": int(rng.integers(1 << 31)),
            }
        asked = {name: getattr(config, name) for name in names} | more
        found = self.client.infer(sent_points(points, config.max_points), **asked)
        best = most_confident(found.confidences, config.max_grasps)
        Ts, widths = self._tcps(found, best, cloud)
        return proposals(Ts, widths, found.confidences[best], self.hand, config.score)

    def _tcps(
        self, found: Grasps, index: np.ndarray, cloud: ObjectCloud
    ) -> tuple[Float[np.ndarray, "n 4 4"], Float[np.ndarray, "n"]]:
        """T_world_tcp = base @ translation(fingertip), and widths.

        Fingertips that travel on an arc are where they are once the fingers touch the object; where that is and how
        wide the object is there depend on each other, so that both are found in turn.
        """
        Ts, told = found.Ts[index], np.clip(found.widths_m[index], 0.0, self.hand.max_width_m)
        widths = np.where(np.isnan(told), self.hand.max_width_m, told)
        for _ in range(_ROUNDS):
            Ts_world_tcp = along_axes(Ts, self._fingertips(widths))
            measured = measured_widths(Ts_world_tcp, cloud.points, self.hand)
            widths = np.where(np.isnan(told), measured, told)
        return along_axes(Ts, self._fingertips(widths)), widths

    def _fingertips(self, widths_m: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n 3"]:
        if self.asked.fingertip_m is not None:
            return np.tile(self.asked.fingertip_m, (len(widths_m), 1))
        return fingertips(self.gripper, widths_m)
