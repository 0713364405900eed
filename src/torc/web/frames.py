"""Pictures for pages that are open, such as the robot from outside while it works, and the arrays of a pick."""

import json
import struct
import time
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from jaxtyping import UInt8

from torc.io.pictures import jpeg_bytes
from torc.sim.rendering import CameraRenderer, Closing
from torc.sim.simulated_world import World
from torc.trials import video
from torc.trials.pick_view import POINT_UNIT_M, PickView

MOUNT = replace(video.MOUNT, width=560, height=420)
OBSERVATIONS_PER_FRAME = 3
"""The simulation calls 25 times a simulated second."""
MIN_INTERVAL_S = 0.04
"""Least wall time between two frames, so that a fast machine does not show a blur: about three times real speed."""
WATCHED_FOR_S = 3.0
_JPEG_QUALITY = 80
_ALIGN = 8


class FrameBoard:
    """The latest picture, with facts by name. Pages read it; one thread replaces it while a page watches.

    `task` is a fact of all pictures: what the page shows, if it is not only a camera.
    """

    def __init__(self, task: str = "") -> None:
        self._task = {"task": task} if task else {}
        # Replaced as a whole, so that readers need no lock.
        self._latest: tuple[int, bytes, dict[str, str]] = 0, b"", {}
        self._watched_at = -WATCHED_FOR_S

    def put(self, jpeg: bytes, facts: Mapping[str, str] = MappingProxyType({})) -> None:
        self._latest = self._latest[0] + 1, jpeg, {**facts, **self._task}

    def trouble(self, text: str) -> None:
        """Say why there is no next picture; the last one stays."""
        self.put(self._latest[1], {"trouble": text})

    def watch(self) -> tuple[int, bytes, dict[str, str]]:
        """Return number (0 before the first), content and facts of the latest picture, which is now watched."""
        self._watched_at = time.monotonic()
        return self._latest

    @property
    def watched(self) -> bool:
        """True if a page asked for a picture lately."""
        return time.monotonic() - self._watched_at < WATCHED_FOR_S


class RobotCamera(Closing):
    """An observer of the simulation that puts pictures on a board. It changes nothing in the world.

    Use it in a `with` in the thread that runs the simulation.
    """

    def __init__(self, board: FrameBoard) -> None:
        self._board = board
        self._renderer: CameraRenderer | None = None
        self._calls, self._drawn_at = 0, 0.0

    def observe(self, world: World) -> None:
        """Draw a picture if it is time for one. Called by the simulation."""
        self._calls += 1
        if self._calls % OBSERVATIONS_PER_FRAME != 1 or not self._board.watched:
            return
        self._renderer = self._renderer or CameraRenderer(world, MOUNT)
        self._board.put(jpeg(self._renderer.render_color()))
        time.sleep(max(0.0, self._drawn_at + MIN_INTERVAL_S - time.monotonic()))
        self._drawn_at = time.monotonic()

    def close(self) -> None:
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None


def jpeg(rgb: UInt8[np.ndarray, "h w 3"]) -> bytes:
    """Return a picture as a JPEG file, as small as a live page needs it."""
    return jpeg_bytes(rgb, _JPEG_QUALITY)


def pack_view(view: PickView) -> bytes:
    """Pack a view's arrays for the page.

    Bytes 0-3: length of a JSON header, little-endian; the header; then each array at the offset in the header. Offsets
    count from the end of the header and are multiples of 8. Arrays are little-endian, C order. Masks of up to 64 bits
    are two 32-bit halves, the low one first.
    """
    cloud, unseen, grasps = view.cloud, view.unseen, view.grasps
    arrays = {
        "labels": view.label_image,
        "points": cloud.points,
        "colors": cloud.rgb,
        "ids": cloud.ids,
        "voxels": unseen.index,
        "hider": unseen.hider,
        "hiders": unseen.hiders.astype("<u8").view("<u4").reshape(-1, 2),
        "grasps": grasps.Ts_world_tcp,
        "grasp_ids": grasps.object_ids,
        "grasp_widths": grasps.widths_m,
        "grasp_status": grasps.status,
    }
    listed, data = [], b""
    for name, array in arrays.items():
        listed.append({"name": name, "type": array.dtype.str[1:], "shape": array.shape, "offset": len(data)})
        raw = np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes()
        data += raw + bytes(-len(raw) % _ALIGN)
    header = {
        "arrays": listed,
        "point_unit_m": POINT_UNIT_M,
        "origin": unseen.grid.origin.tolist(),
        "voxel_size_m": unseen.grid.voxel_size_m,
        "grid": list(unseen.grid.shape),
        "K": view.K.tolist(),
        "T_world_camera": view.T_world_camera.tolist(),
    }
    text = json.dumps(header).encode()
    text += b" " * (-(len(text) + 4) % _ALIGN)
    return struct.pack("<I", len(text)) + text + data
