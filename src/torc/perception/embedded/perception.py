"""The stage `--perception embedded`: finds objects, their ids and the target from colour and depth alone."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float32, Int16
from numba import njit

from torc.parallel import each
from torc.perception.embedded.inputs import (
    View,
    Window,
    channels,
    cut,
    hangs_upside_down,
    turned_over,
    window_on,
)
from torc.perception.embedded.instances import OFFSETS, InstanceConfig, find_instances
from torc.perception.embedded.model import MULTIPLE_PX, segment_patch
from torc.perception.from_masks import FromMasks, FromMasksConfig, Masks
from torc.perception.protocol import Wanted
from torc.perception.segmentation import valid_depth
from torc.records import Observation
from torc.workspace.description import Workspace


@dataclass(frozen=True)
class EmbeddedConfig(FromMasksConfig):
    """Settings of torc's own perception.

    Attributes:
        instances: how masks are made from the network's output.
    """

    instances: InstanceConfig = field(default_factory=InstanceConfig)


class EmbeddedPerception(FromMasks):
    """Finds objects on the workspace's support, keeps their ids, and recognises the target by reference pictures."""

    needs_pictures = True
    """A simulated trial takes reference pictures of the target for it."""
    config: EmbeddedConfig

    def __init__(self, config: EmbeddedConfig | None = None, workspace: Workspace | None = None) -> None:
        super().__init__(EmbeddedConfig() if config is None else config, workspace)

    def find(self, observation: Observation, wanted: Wanted) -> Masks:
        """Return the masks; `wanted` is ignored."""
        return Masks(*self.masks(observation))

    def masks(self, observation: Observation) -> tuple[Int16[np.ndarray, "h w"], Float32[np.ndarray, "n"]]:
        """Return the number of the mask per pixel, -1 for none, and how surely each is one object."""
        clouds = self.config.clouds
        depth = valid_depth(observation.depth_m, clouds.min_depth_m, clouds.max_depth_m).astype(np.float32)
        pose = observation.T_world_camera
        view = View(observation.rgb, depth, observation.K, pose, self.workspace.support_z_m)
        # The network was trained on things that stand upright in the picture.
        upside_down = hangs_upside_down(pose)
        view = turned_over(view) if upside_down else view
        place = window_on(view, self.workspace.grid, MULTIPLE_PX)
        if place is None:
            return np.full(depth.shape, -1, np.int16), np.zeros(0, np.float32)
        window, height, width = place
        inputs = channels(cut(view, window, height, width))
        out = both_ways(lambda given: segment_patch(given, self.config.threads), inputs)
        found = find_instances(out[0], out[1:], self.config.instances)
        label = uncut(found.label, window, depth.shape)
        return np.ascontiguousarray(label[::-1, ::-1]) if upside_down else label, found.sureness


def uncut(
    label: Int16[np.ndarray, "h w"], window: Window, shape: tuple[int, ...]
) -> Int16[np.ndarray, "a b"]:
    """Return the labels of a patch in a picture of that shape, -1 outside."""
    out = np.full(shape, -1, np.int16)
    height, width = label.shape
    rows = np.arange(window.row, min(window.row + int(height / window.scale), shape[0]))
    cols = np.arange(window.col, min(window.col + int(width / window.scale), shape[1]))
    to_rows, to_cols = (
        np.clip(np.rint((np.arange(len(n)) + 0.5) * window.scale - 0.5), 0, size - 1).astype(np.int64)
        for n, size in ((rows, height), (cols, width))
    )
    out[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1] = label[to_rows][:, to_cols]
    return out


_ACROSS = 2
"""Channel of the normal's part to the right, which a mirror reverses."""


def both_ways(
    network: Callable[[Float32[np.ndarray, "c h w"]], Float32[np.ndarray, "o h w"]],
    inputs: Float32[np.ndarray, "c h w"],
) -> Float32[np.ndarray, "o h w"]:
    """Return the network's mean output for a picture and its mirror image, in the picture's own pixels."""
    image = np.ascontiguousarray(inputs[..., ::-1])
    image[_ACROSS] = -image[_ACROSS]
    out, turned = each(network, [inputs, image])
    out = np.array(out)  # the network may keep its own
    _add_mirrored(out, turned, _OFFSETS, _MIRRORED)
    return out


_OFFSETS = np.array(OFFSETS)
_MIRRORED = np.array([OFFSETS.index((r, -c)) if (r, -c) in OFFSETS else -1 for r, c in OFFSETS])
"""Place among the offsets of each one's mirror image; -1 for those to the right alone."""


@njit(cache=True)
def _add_mirrored(out, turned, offsets, mirrored):
    """Replace the output by its mean with that for a mirror image, where the partner lies inside the image."""
    half, width = np.float32(0.5), out.shape[2]
    for k in range(out.shape[0]):
        # Only to the right: the pair is the partner's, which is as many columns to the left in the mirror.
        shared = k == 0 or mirrored[k - 1] >= 0
        shift = 0 if shared else offsets[k - 1, 1]
        other = turned[1 + mirrored[k - 1] if k > 0 and shared else k]
        for row in range(out.shape[1]):
            for col in range(width - shift):
                out[k, row, col] = half * (out[k, row, col] + other[row, width - 1 - col - shift])
