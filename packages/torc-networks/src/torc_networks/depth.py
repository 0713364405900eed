"""The stage `--depth network`: depth from two pictures by a matcher in another process, such as FoundationStereo."""

from dataclasses import dataclass, field
from typing import ClassVar

from torc import Observation
from torc.perception.stereo import LearnedStereoConfig, is_scaled, pair_of, scaled, with_disparity
from torc_networks.addresses import ServerConfig
from torc_networks.client import NetworkClient


@dataclass(frozen=True)
class NetworkDepthConfig(LearnedStereoConfig):
    """A matcher, and where it runs."""

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
        """The observation with depth from its pair. Raises InputError if it has none, and NetworkError."""
        config, pair = self.config, pair_of(observation, "network")
        left, right = scaled(pair.left, config.scale), scaled(pair.right, config.scale)
        found = self.client.stereo(left, right, config.most_px(pair, float(observation.K[0, 0])))
        shape = found.disparity_px.shape
        if not is_scaled(shape, observation.depth_m.shape):
            why = f"its disparity is {shape} pixels, the pictures are {left.shape}: not the same at another scale."
            raise self.client.unusable("stereo", why)
        return with_disparity(observation, found.disparity_px, found.confidence, pair.baseline_m, config)
