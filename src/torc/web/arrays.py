"""The large part of a pick for the page: masks, cloud, unseen voxels and grasps in one binary message."""

import json
import struct

import numpy as np

from torc.episode.pick_view import POINT_UNIT_M, PickView

_ALIGN = 8


def pack_view(view: PickView) -> bytes:
    """Bytes 0-3: length of a JSON header, little-endian; the header; then each array at the offset that it names.

    Offsets count from the end of the header and are multiples of 8. Arrays are little-endian, C order. Masks of up to
    64 bits come as two 32-bit halves, low one first.
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
        entry = {"name": name, "type": array.dtype.str[1:], "shape": array.shape, "offset": len(data)}
        listed.append(entry)
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
