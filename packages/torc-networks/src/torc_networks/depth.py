"""The stage `--depth network`: a server, such as FoundationStereo, matches the camera's two pictures."""

from dataclasses import dataclass, field
from typing import ClassVar

from torc import Observation
from torc.perception.stereo import LearnedStereoConfig, is_scaled, pair_of, scaled, with_disparity
from torc_networks.addresses import ServerConfig
from torc_networks.client import NetworkClient
from torc_networks.fields import read_disparity


@dataclass(frozen=True)
class NetworkDepthConfig(LearnedStereoConfig):
    """A learned matcher, and where it runs."""

    server: ServerConfig = field(default_factory=lambda: ServerConfig("tcp://127.0.0.1:5555"))


class NetworkDepth:
    """Depth from the camera's two pictures, matched by a server."""

    needs_pair: ClassVar[bool] = True
    """A simulated camera takes both pictures."""
    rough: ClassVar[bool] = True
    """Perception and occlusion volume take their settings for real cameras."""

    def __init__(self, config: NetworkDepthConfig | None = None) -> None:
        self.config = NetworkDepthConfig() if config is None else config
        self.client = NetworkClient(self.config.server)

    def measure(self, observation: Observation) -> Observation:
        """Return the observation with depth from its pair. Raises InputError if it has none, and NetworkError."""
        config, pair = self.config, pair_of(observation, "network")
        left, right = scaled(pair.left, config.scale), scaled(pair.right, config.scale)
        most_px = config.most_px(pair, float(observation.K[0, 0]))
        answer = self.client.ask("stereo", left=left, right=right, max_disparity=most_px)
        disparity_px, confidence = read_disparity(answer)
        if not is_scaled(disparity_px.shape, observation.depth_m.shape):
            raise answer.refuse(
                f"its disparity is {disparity_px.shape} pixels, the pictures are {left.shape}."
            )
        return with_disparity(observation, disparity_px, confidence, pair.baseline_m, config)
