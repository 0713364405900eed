"""The grasp planners `graspgenx` and `contact-graspnet`: torc checks, scores and selects a server's candidates."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, Int16

from torc import InputError
from torc.geometry.transforms import Pose, invert, transform_points
from torc.grasping.clouds import ObjectCloud, SceneClouds
from torc.grasping.config import GraspConfig
from torc.grasping.generators import RawCandidates
from torc.grasping.geometric_planner import GeometricGraspPlanner, Proposals, Rngs
from torc.grasping.protocol import GraspScorer
from torc.records import BACKGROUND, SegmentedScene
from torc.robots.gripper import GripperDescription
from torc_networks.addresses import ServerConfig
from torc_networks.client import NetworkClient
from torc_networks.fields import Grasps, read_grasps
from torc_networks.grasping.frames import (
    along_axes,
    fingertips,
    gripper_config,
    measured_widths,
    tcp_of_contact_graspnet,
)

_NEAR_M, _FAR_M = 0.2, 1.8
"""Depth range of the surroundings that Contact-GraspNet itself uses."""
_ROUNDS = 3


@dataclass(frozen=True)
class NetworkGraspConfig(GraspConfig):
    """A network's server, and the use of its answers; checks and selection are as in `geometric`.

    Attributes:
        server: proposes the grasps.
        max_points: points sent per object.
        max_grasps: grasps examined per object, those with the highest confidence.
        score: "torc" scores the grasps by torc's own model, as a probability of delivery; "network" keeps the
            network's confidence.
    """

    server: ServerConfig = field(default_factory=lambda: ServerConfig("tcp://127.0.0.1:5556"))
    max_points: int = 10_000
    max_grasps: int = 300
    score: str = "torc"

    def __post_init__(self) -> None:
        if self.score not in ("torc", "network"):
            raise InputError(f"The score of a network's grasps is 'torc' or 'network', not '{self.score}'.")
        if self.max_points < 1 or self.max_grasps < 1:
            raise InputError("max_points and max_grasps of a grasp network must be at least 1.")

    def sent(self, points: np.ndarray) -> Float32[np.ndarray, "m 3"]:
        """Return at most `max_points` of the points, evenly chosen."""
        return np.ascontiguousarray(points[:: -(-len(points) // self.max_points) or 1], np.float32)

    def most_confident(self, confidences: Float[np.ndarray, "n"]) -> np.ndarray:
        """Return the indices of at most `max_grasps` grasps, in their order."""
        return np.sort(np.argsort(-confidences, kind="stable")[: self.max_grasps])

    def proposals(
        self,
        Ts_world_tcp: Float[np.ndarray, "n 4 4"],
        widths_m: Float[np.ndarray, "n"],
        confidences: Float[np.ndarray, "n"],
        max_width_m: float,
    ) -> Proposals:
        """Return candidates for torc's checks."""
        # Wider than the gripper opens, nothing would be looked for where its fingers are.
        widths = np.clip(widths_m, 0.0, max_width_m)
        raw = RawCandidates(Ts_world_tcp[:, :3, :3].copy(), Ts_world_tcp[:, :3, 3].copy(), widths)
        scores = confidences if self.score == "network" else None
        return Proposals(raw, np.zeros(len(widths), np.uint8), scores)


@dataclass(frozen=True)
class GraspGenXConfig(NetworkGraspConfig):
    """Settings of GraspGenX and GraspGen.

    Attributes:
        num_grasps, topk_num_grasps, grasp_threshold, min_grasps, max_tries, remove_outliers: as GraspGen's server takes
            them.
        describe: send torc's description of the gripper and a seed. A server that was started for one gripper, as
            NVIDIA's are, ignores both.
        gripper_type: kind of gripper in that description: parallel_2f or revolute_2f.
        fingertip_m: the TCP in the frame of the gripper that the server knows by itself; None: as torc knows it, for
            the opening that the object leaves.
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
    """Asks a GraspGen or GraspGenX server about one object at a time."""

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
        """Return the server's grasps of each object. Raises NetworkError."""
        return {
            cloud.id: self._asked_for(scene.object(cloud.id).points, cloud, rngs[cloud.id])
            for cloud in clouds.objects
        }

    def _asked_for(self, points: np.ndarray, cloud: ObjectCloud, rng: np.random.Generator) -> Proposals:
        config = self.asked
        fields: dict[str, Any] = {
            "num_grasps": config.num_grasps,
            "topk_num_grasps": config.topk_num_grasps,
            "grasp_threshold": config.grasp_threshold,
            "min_grasps": config.min_grasps,
            "max_tries": config.max_tries,
            "remove_outliers": config.remove_outliers,
        }
        if config.describe:
            fields["gripper"] = gripper_config(self.gripper, config.gripper_type)
            fields["seed"] = int(rng.integers(1 << 31))
        found = read_grasps(self.client.ask("infer", point_cloud=config.sent(points), **fields))
        best = config.most_confident(found.confidences)
        Ts, widths = self._tcps(found, best, cloud)
        return config.proposals(Ts, widths, found.confidences[best], self.hand.max_width_m)

    def _tcps(
        self, found: Grasps, index: np.ndarray, cloud: ObjectCloud
    ) -> tuple[Float[np.ndarray, "n 4 4"], Float[np.ndarray, "n"]]:
        """Return T_world_tcp = base @ translation(fingertip), and widths.

        Fingertips that travel on an arc are taken where the fingers touch the object. That place and the object's width
        there depend on each other, so they are found in turn.
        """
        Ts, given = found.Ts[index], np.clip(found.widths_m[index], 0.0, self.hand.max_width_m)
        widths = np.where(np.isnan(given), self.hand.max_width_m, given)
        for _ in range(_ROUNDS):
            Ts_world_tcp = along_axes(Ts, self._fingertips(widths))
            measured = measured_widths(Ts_world_tcp, cloud.points, self.hand)
            widths = np.where(np.isnan(given), measured, given)
        return along_axes(Ts, self._fingertips(widths)), widths

    def _fingertips(self, widths_m: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n 3"]:
        if self.asked.fingertip_m is not None:
            return np.tile(self.asked.fingertip_m, (len(widths_m), 1))
        return fingertips(self.gripper, widths_m)


@dataclass(frozen=True)
class ContactGraspNetConfig(NetworkGraspConfig):
    """Settings of Contact-GraspNet."""

    server: ServerConfig = field(default_factory=lambda: ServerConfig("tcp://127.0.0.1:5557"))


class ContactGraspNetPlanner(GeometricGraspPlanner):
    """Asks a Contact-GraspNet server about all objects at once."""

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
        """Return the server's grasps of all objects. Raises NetworkError."""
        if not clouds.objects:
            return {}
        T_world_camera = np.asarray(scene.observation.T_world_camera, float)
        points, ids = self._scene_points(scene, invert(T_world_camera))
        seed = int(rngs[clouds.objects[0].id].integers(1 << 31))
        answer = self.client.ask(
            "grasps", point_cloud=points, object_ids=ids, T_world_camera=T_world_camera, seed=seed
        )
        found = read_grasps(answer, of_scene=True)
        if unknown := sorted(set(found.object_ids.tolist()) - set(scene.ids)):
            raise answer.refuse(f"it has grasps for objects {unknown}, and was asked for {list(scene.ids)}.")
        Ts = tcp_of_contact_graspnet(found.Ts, T_world_camera)
        out = {}
        for cloud in clouds.objects:
            own = np.flatnonzero(found.object_ids == cloud.id)
            own = own[self.asked.most_confident(found.confidences[own])]
            given = found.widths_m[own]
            widths = np.where(np.isnan(given), measured_widths(Ts[own], cloud.points, self.hand), given)
            confidences, most_m = found.confidences[own], self.hand.max_width_m
            out[cloud.id] = self.asked.proposals(Ts[own], widths, confidences, most_m)
        return out

    def _scene_points(
        self, scene: SegmentedScene, T_camera_world: Pose
    ) -> tuple[Float32[np.ndarray, "n 3"], Int16[np.ndarray, "n"]]:
        """Return all objects and their surroundings, camera frame, and each point's owner; BACKGROUND for the table."""
        parts = {o.id: transform_points(T_camera_world, o.points.astype(float)) for o in scene.objects}
        around = transform_points(T_camera_world, scene.background_points.astype(float))
        parts[BACKGROUND] = around[(around[:, 2] > _NEAR_M) & (around[:, 2] < _FAR_M)]
        sent = {k: self.asked.sent(points) for k, points in parts.items()}
        ids = np.concatenate([np.full(len(p), k, np.int16) for k, p in sent.items()])
        return np.concatenate([*sent.values()]), ids
