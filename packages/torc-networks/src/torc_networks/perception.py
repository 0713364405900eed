"""The stage `--perception network`: as `embedded`, but for the masks, which a server makes, such as SAM."""

from dataclasses import dataclass, field

import cv2
import numpy as np
from jaxtyping import Bool

from torc import Observation, Wanted
from torc.perception.from_masks import FromMasks, FromMasksConfig, Masks
from torc.perception.segmentation import valid_depth
from torc.perception.stereo import is_scaled
from torc.workspace.description import Workspace
from torc_networks.addresses import ServerConfig
from torc_networks.client import NetworkClient
from torc_networks.proposals import LayoutConfig, Proposals, objects_among


@dataclass(frozen=True)
class NetworkPerceptionConfig(FromMasksConfig):
    """Who makes the masks, and which of them are objects; the rest is as in `embedded`.

    Attributes:
        prompt: what to look for, for a server that is told in words.
        min_score: masks with a lower score are left out.
        layout: which of the others are objects.
    """

    server: ServerConfig = field(default_factory=lambda: ServerConfig("tcp://127.0.0.1:5554"))
    prompt: str = "object."
    min_score: float = 0.0
    layout: LayoutConfig = field(default_factory=LayoutConfig)


class NetworkPerception(FromMasks):
    """Objects by a server's masks; their ids, the target and the clouds are made here."""

    needs_pictures = True
    """A simulated trial takes reference pictures of the target for it."""

    def __init__(
        self, config: NetworkPerceptionConfig | None = None, workspace: Workspace | None = None
    ) -> None:
        self.asked = NetworkPerceptionConfig() if config is None else config
        super().__init__(self.asked, workspace)
        self.client = NetworkClient(self.asked.server)

    def find(self, observation: Observation, wanted: Wanted) -> Masks:
        """The masks, whatever is wanted. Raises NetworkError."""
        config, clouds = self.asked, self.asked.clouds
        depth = valid_depth(observation.depth_m, clouds.min_depth_m, clouds.max_depth_m).astype(np.float32)
        camera = {"K": observation.K, "T_world_camera": observation.T_world_camera}
        found = self.client.segment(observation.rgb, prompt=config.prompt, depth_m=depth, **camera)
        if len(found.masks) and not is_scaled(found.masks.shape[1:], depth.shape):
            sizes = f"its masks are {found.masks.shape[1:]} pixels, the picture is {depth.shape}"
            raise self.client.unusable("segment", f"{sizes}: not the same at another scale.")
        masks = [_resized(m, depth.shape) for m in found.masks]
        good = np.flatnonzero(found.scores >= config.min_score)
        proposals = Proposals(
            np.reshape(masks, (-1, *depth.shape)).astype(bool), found.scores, np.zeros_like(found.scores)
        )
        laid = objects_among(proposals[good], observation, self.workspace, clouds, config.layout)
        return Masks(laid.label, laid.sureness)


def _resized(mask: Bool[np.ndarray, "h w"], shape: tuple[int, ...]) -> Bool[np.ndarray, "rows cols"]:
    if mask.shape == shape:
        return mask
    resized = cv2.resize(mask.astype(np.uint8), shape[::-1], interpolation=cv2.INTER_NEAREST_EXACT)
    return np.asarray(resized > 0)
