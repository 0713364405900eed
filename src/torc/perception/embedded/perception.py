"""The stage `--perception embedded`: objects, their ids and the target, from colour and depth alone."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float32, Int16

from torc.perception.embedded.inputs import Patch, View, Window, channels, cut, hangs_upside_down, turned_over
from torc.perception.embedded.instances import InstanceConfig, Instances, find_instances
from torc.perception.embedded.mirror import both_ways
from torc.perception.embedded.model import MULTIPLE_PX, segment_patch
from torc.perception.embedded.region import window_on
from torc.perception.from_masks import FromMasks, FromMasksConfig, Masks
from torc.perception.protocol import Wanted
from torc.perception.segmentation import valid_depth
from torc.records import Observation
from torc.workspace.description import Workspace


@dataclass(frozen=True)
class EmbeddedConfig(FromMasksConfig):
    """Settings of torc's own eyes.

    Attributes:
        instances: how masks are made of what the network says.
    """

    instances: InstanceConfig = field(default_factory=InstanceConfig)


class EmbeddedPerception(FromMasks):
    """Finds the objects on the workspace's support, keeps their ids, and knows the target by reference pictures."""

    needs_pictures = True
    """A simulated trial takes reference pictures of the target for it."""
    config: EmbeddedConfig

    def __init__(self, config: EmbeddedConfig | None = None, workspace: Workspace | None = None) -> None:
        super().__init__(EmbeddedConfig() if config is None else config, workspace)

    def find(self, observation: Observation, wanted: Wanted) -> Masks:
        """The masks, whatever is wanted."""
        return Masks(*self.masks(observation))

    def masks(self, observation: Observation) -> tuple[Int16[np.ndarray, "h w"], Float32[np.ndarray, "n"]]:
        """Number of the mask per pixel of the picture, -1 for none, and how surely each is one object."""
        clouds = self.config.clouds
        depth = valid_depth(observation.depth_m, clouds.min_depth_m, clouds.max_depth_m).astype(np.float32)
        pose = observation.T_world_camera
        view = View(observation.rgb, depth, observation.K, pose, self.workspace.support_z_m)
        # The network was shown things that stand upright in the picture.
        upside_down = hangs_upside_down(pose)
        view = turned_over(view) if upside_down else view
        place = window_on(view, self.workspace.grid, MULTIPLE_PX)
        if place is None:
            return np.full(depth.shape, -1, np.int16), np.zeros(0, np.float32)
        window, height, width = place
        instances = self._instances(cut(view, window, height, width))
        label = uncut(instances.label, window, depth.shape)
        return np.ascontiguousarray(label[::-1, ::-1]) if upside_down else label, instances.sureness

    def _instances(self, patch: Patch) -> Instances:
        threads = self.config.threads
        out = both_ways(lambda inputs: segment_patch(inputs, threads), channels(patch))
        return find_instances(out[0], out[1:], self.config.instances)


def uncut(
    label: Int16[np.ndarray, "h w"], window: Window, shape: tuple[int, ...]
) -> Int16[np.ndarray, "a b"]:
    """The labels of a patch in a picture of that shape, -1 outside of it."""
    out = np.full(shape, -1, np.int16)
    height, width = label.shape
    rows = np.arange(window.row, min(window.row + int(height / window.scale), shape[0]))
    cols = np.arange(window.col, min(window.col + int(width / window.scale), shape[1]))
    to_rows, to_cols = (
        np.clip(np.rint((np.arange(len(n)) + 0.5) * window.scale - 0.5), 0, size - 1).astype(np.int64)
        for n, size in ((rows, height), (cols, width))
    )
    out[rows[:, None], cols] = label[to_rows[:, None], to_cols]
    return out
