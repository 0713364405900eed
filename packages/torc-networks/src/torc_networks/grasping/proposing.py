"""What the planners share: settings, the points that are sent, and proposals from what comes back."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Float32

from torc import InputError
from torc.grasping.config import GraspConfig
from torc.grasping.generators import RawCandidates
from torc.grasping.geometric_planner import Proposals
from torc.grasping.hand import HandGeometry
from torc_networks.addresses import ServerConfig


@dataclass(frozen=True)
class NetworkGraspConfig(GraspConfig):
    """A network's server, and what is taken of its answers; checks and selection are as in `geometric`.

    Attributes:
        max_points: points sent per object.
        max_grasps: grasps examined per object, those with the highest confidence.
        score: "torc" rates the grasps by torc's own model, as a probability of delivery; "network" takes the network's
            confidence as it is.
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


def sent_points(points: Float32[np.ndarray, "n 3"], most: int) -> Float32[np.ndarray, "m 3"]:
    """So many of the points at most, evenly chosen."""
    return np.ascontiguousarray(points[:: -(-len(points) // most) or 1], np.float32)


def most_confident(confidences: Float[np.ndarray, "n"], most: int) -> np.ndarray:
    """Indices of so many at most, in their order."""
    return np.sort(np.argsort(-confidences, kind="stable")[:most])


def proposals(
    Ts_world_tcp: Float[np.ndarray, "n 4 4"],
    widths_m: Float[np.ndarray, "n"],
    confidences: Float[np.ndarray, "n"],
    hand: HandGeometry,
    score: str,
) -> Proposals:
    """Candidates for torc's checks."""
    # Wider than the gripper opens, nothing would be looked for where its fingers are.
    widths = np.clip(widths_m, 0.0, hand.max_width_m)
    raw = RawCandidates(Ts_world_tcp[:, :3, :3].copy(), Ts_world_tcp[:, :3, 3].copy(), widths)
    scores = confidences if score == "network" else None
    return Proposals(raw, np.zeros(len(widths), np.uint8), scores)
