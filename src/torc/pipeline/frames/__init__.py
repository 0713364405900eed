"""One RGB-D frame with masks, from anywhere: read, checked, and turned into an Observation.

Two forms are read and written:

- a .npz file with rgb (h, w, 3 uint8), depth_m (float, metres) or depth (integers) with depth_scale (metres per unit,
  0.001 by default), K (3x3), T_world_camera (4x4, OpenCV camera axes, z of the world upwards), labels (h, w integers),
  and optionally target, target_description, support_z_m, background, robot, grid_origin, grid_voxel_size_m and
  grid_shape;
- a directory with rgb.png, depth.png (16 bits), labels.png (8 or 16 bits) and frame.json: intrinsics {fx, fy, cx, cy}
  or K, camera_pose (4x4, or {position, wxyz}), depth_scale_m (0.001), and optionally the same settings, names
  ({label: name}) and grid ({origin, voxel_size_m, shape}).

`target` is a label, a name, or "hidden"; without it label 0 is the target if it is an object's, else the target is
hidden. `background` is -1 if labels hold negative numbers, else 0; `robot` is -2. Readings of depth from 0.1 to 10 m
are used; 0, NaN and infinity stand for none.
"""

from torc.pipeline.frames.files import load_frame, save_frame
from torc.pipeline.frames.record import Frame

__all__ = ["Frame", "load_frame", "save_frame"]
