"""The stage `--perception network`: a server, such as SAM, makes the masks; the rest is as in `embedded`."""

from dataclasses import dataclass, field

import numpy as np

from torc import Observation, Wanted
from torc.perception.from_masks import FromMasks, FromMasksConfig, Masks
from torc.perception.segmentation import valid_depth
from torc.perception.stereo import full_size, is_scaled
from torc.workspace.description import Workspace
from torc_networks.addresses import ServerConfig
from torc_networks.client import NetworkClient
from torc_networks.fields import read_masks
from torc_networks.proposals import LayoutConfig, Proposals, objects_among


@dataclass(frozen=True)
class NetworkPerceptionConfig(FromMasksConfig):
    """The masks' server, and which masks are objects; the rest is as in `embedded`.

    Attributes:
        server: makes the masks.
        prompt: what to look for, in words, for servers that read them.
        min_score: masks with a lower score are dropped.
        layout: which of the others are objects.
    """

    server: ServerConfig = field(default_factory=lambda: ServerConfig("tcp://127.0.0.1:5554"))
    prompt: str = "object."
    min_score: float = 0.0
    layout: LayoutConfig = field(default_factory=LayoutConfig)


class NetworkPerception(FromMasks):
    """Finds objects by a server's masks; ids, target and clouds are made here."""

    needs_pictures = True
    """A simulated trial takes reference pictures of the target for it."""

    def __init__(
        self, config: NetworkPerceptionConfig | None = None, workspace: Workspace | None = None
    ) -> None:
        self.asked = NetworkPerceptionConfig() if config is None else config
        super().__init__(self.asked, workspace)
        self.client = NetworkClient(self.asked.server)

    def find(self, observation: Observation, wanted: Wanted) -> Masks:
        """Return the masks, whatever is wanted. Raises NetworkError."""
        config, clouds = self.asked, self.asked.clouds
        depth = valid_depth(observation.depth_m, clouds.min_depth_m, clouds.max_depth_m).astype(np.float32)
        camera = {"K": observation.K, "T_world_camera": observation.T_world_camera}
        answer = self.client.ask(
            "segment", rgb=observation.rgb, prompt=config.prompt, depth_m=depth, **camera
        )
        found = read_masks(answer)
        if len(found.masks) and not is_scaled(found.masks.shape[1:], depth.shape):
            raise answer.refuse(
                f"its masks are {found.masks.shape[1:]} pixels, the picture is {depth.shape}."
            )
        good = found.scores >= config.min_score
        masks = [full_size(m.astype(np.float32), depth.shape) > 0 for m in found.masks[good]]
        scores = found.scores[good]
        proposals = Proposals(
            np.reshape(masks, (-1, *depth.shape)).astype(bool), scores, np.zeros_like(scores)
        )
        laid = objects_among(proposals, observation, self.workspace, clouds, config.layout)
        return Masks(laid.label, laid.sureness)
