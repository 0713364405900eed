"""Snapshots as ROS publishes them."""

import base64
from typing import Any

import numpy as np

from torc import Observation
from torc_lab.ros.messages import RosVersion, duration


def image_messages(view: Observation, ros: RosVersion) -> dict[str, dict[str, Any]]:
    """A snapshot as Image messages of colour ("color") and depth ("depth", millimetres), and as CameraInfo ("info")."""
    height, width = view.depth_m.shape
    stamp = duration(view.stamp_s, ros)
    header = {"stamp": stamp, "frame_id": "camera_color_optical_frame"}
    depth = np.clip(np.rint(view.depth_m * 1e3), 0, 65535).astype("<u2")

    def image(encoding: str, pixels: np.ndarray, bytes_per_pixel: int) -> dict[str, Any]:
        return {
            "header": header,
            "height": height,
            "width": width,
            "encoding": encoding,
            "is_bigendian": 0,
            "step": width * bytes_per_pixel,
            "data": base64.b64encode(np.ascontiguousarray(pixels).tobytes()).decode("ascii"),
        }

    fx, fy, cx, cy = view.K[0, 0], view.K[1, 1], view.K[0, 2], view.K[1, 2]
    k = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    p = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    names = {"K": k, "D": [0.0] * 5, "R": np.eye(3).ravel().tolist(), "P": p}
    names = names if ros == 1 else {name.lower(): value for name, value in names.items()}
    info = {"header": header, "height": height, "width": width, "distortion_model": "plumb_bob", **names}
    info |= {"binning_x": 0, "binning_y": 0, "roi": {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0}}
    return {"color": image("rgb8", view.rgb, 3), "depth": image("16UC1", depth, 2), "info": info}
