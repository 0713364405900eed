"""Handlers for masks and disparities: torc's own eyes, and semi-global block matching."""

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from jaxtyping import UInt8

from torc import Observation
from torc.perception.embedded.perception import EmbeddedPerception
from torc.perception.stereo import SgbmConfig, SgbmMatcher
from torc.workspace.description import Workspace
from torc_networks.fields import Fields, request
from torc_networks.server import Handler

_MOST_DISPARITY_PX = 1024


def segment_handler(workspace: Workspace) -> Handler:
    """{rgb (h, w, 3), depth_m (h, w), K (3, 3), T_world_camera (4, 4)} to {labels (h, w), scores (n)}, by the masks of
    `--perception embedded`; a prompt is not looked at.
    """
    eyes = EmbeddedPerception(workspace=workspace)

    def segment(asked: Mapping[str, Any]) -> Mapping[str, Any]:
        fields = request(asked)
        rgb = fields.bytes("rgb", (None, None, 3))
        depth = fields.array("depth_m", rgb.shape[:2], "f").astype(np.float32)
        K, T_world_camera = fields.finite("K", (3, 3)), fields.pose("T_world_camera")
        label, scores = eyes.masks(Observation(rgb, depth, K, T_world_camera, np.zeros(0), 0.0))
        return {"labels": label, "scores": scores}

    return segment


def stereo_handler(config: SgbmConfig) -> Handler:
    """{left, right (h, w) or (h, w, 3), max_disparity} to {disparity, confidence (h, w)}."""

    def stereo(asked: Mapping[str, Any]) -> Mapping[str, Any]:
        fields = request(asked)
        left, right = (_grey(fields, side) for side in ("left", "right"))
        if left.shape != right.shape:
            raise fields.refuse(f"the left picture is {left.shape}, the right one {right.shape}.")
        most = fields.whole("max_disparity", 1, _MOST_DISPARITY_PX)
        disparity, confidence = SgbmMatcher(most, config).match(left, right)
        return {"disparity": disparity, "confidence": confidence}

    return stereo


def _grey(fields: Fields, side: str) -> UInt8[np.ndarray, "h w"]:
    if getattr(fields.values.get(side), "ndim", 0) == 3:
        return np.asarray(cv2.cvtColor(fields.bytes(side, (None, None, 3)), cv2.COLOR_RGB2GRAY), np.uint8)
    return fields.bytes(side, (None, None))
