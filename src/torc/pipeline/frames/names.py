"""The keys of a frame, and the names that others use for these entries.

Capitals, '_', '-', '.' and spaces are ignored.
"""

import difflib
from collections.abc import Iterable, Mapping
from types import MappingProxyType

from torc.errors import InputError

OTHER_NAMES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        name: tuple(others.split())
        for name, others in {
            "rgb": """
                image img color colour picture rgb_image color_image colour_image rgb_img color_img
                image_rgb image_color rgb_raw color_raw
                """,
            "bgr": "bgr_image image_bgr bgr_img",
            "depth": "depth_image depth_map depth_img image_depth depth_raw dpt aligned_depth",
            "depth_m": "depth_meters depth_metres depth_in_m depth_in_meters",
            "depth_mm": "depth_in_mm depth_millimeters depth_millimetres",
            "labels": """
                label label_image label_map labelmap mask masks instance_mask instance_masks seg
                segs segmap seg_map seg_mask segmask segmentation segmentation_map segmentation_mask
                segmentation_masks segmentations semantic_segmentation instance instances
                instance_map instance_ids instance_segmentation instance_labels object_ids
                object_masks obj_masks mask_image label_img instance_seg
                """,
            "K": """
                intrinsics intrinsic cam_K camera_K camera_matrix cam_matrix cam_intr intr
                cam_intrinsics cam_intrinsic camera_intrinsics camera_intrinsic intrinsic_matrix
                intrinsics_matrix K_matrix mtx color_intrinsics rgb_intrinsics intrinsics_color
                """,
            "T_world_camera": """
                camera_pose cam_pose T_world_cam T_base_camera T_base_cam T_wc T_wcam c2w cam2world
                camera2world cam_to_world camera_to_world world_from_camera T_w_c cam2base
                cam_to_base camera_to_base T_robot_camera pose_of_camera T_c2w X_WC
                camera_pose_in_world world_T_camera world_T_cam base_T_camera base_T_cam
                """,
            "T_camera_world": """
                T_cam_world T_camera_base T_cam_base T_cw w2c world2cam world2camera T_w2c
                world_to_cam world_to_camera camera_from_world base_to_cam base_to_camera T_c_w
                camera_T_world cam_T_world camera_T_base cam_T_base view_matrix
                """,
            "extrinsics": """
                extrinsic extrinsic_matrix extrinsics_matrix camera_extrinsics camera_extrinsic
                cam_extrinsics cam_extrinsic cam_extr extr pose RT transform T_cam T_camera
                camera_transform cam_transform
                """,
            "depth_scale_m": "depth_scale depth_unit_m depth_units depth_units_m",
            "depth_factor": "factor_depth depth_scale_factor units_per_metre units_per_meter",
            "target": "target_id target_label target_object target_instance",
            "target_description": "description target_text target_prompt prompt instruction",
            "support_z_m": "support_z table_z table_z_m table_height_m support_height_m",
            "background": "background_label background_id bg_label",
            "robot": "robot_label robot_id",
            "left": "left_image image_left left_ir ir_left infra1",
            "right": "right_image image_right right_ir ir_right infra2",
        }.items()
    }
)
"""Other names by our name. Some of ours are only read, never written: `bgr`, `depth_mm`, `depth_factor`,
`T_camera_world`, and `extrinsics`, a pose whose name leaves its direction open.
"""
UNUSED: tuple[str, ...] = ("truth", "timestamp", "stamp", "stamp_s")
"""Further entries that a frame may hold: masks to compare with, and when it was taken."""
_LENS = "nothing for lens distortion: undistort the pictures and leave it out"
_OPEN: Mapping[str, str] = MappingProxyType(
    {
        "table_height": "support_z_m (metres, in the world)",
        "baseline": "baseline_m (metres)",
        "quaternion": "camera_pose with position and wxyz (w first)",
        **dict.fromkeys(("xyz", "point_cloud", "disparity"), "depth_m (metres along the optical axis)"),
        **dict.fromkeys(("R", "t"), "T_world_camera, a 4x4 matrix that takes camera points to the world"),
        **dict.fromkeys(("dist", "distortion", "dist_coeffs", "coeffs"), _LENS),
    }
)
"""Ambiguous names, and what to give instead."""


def plain_name(key: str) -> str:
    """Strip a key of what people write differently."""
    return "".join(c for c in key.lower() if c not in "_-. ")


_BY_PLAIN = {plain_name(n): ours for ours, others in OTHER_NAMES.items() for n in (ours, *others)}
_OPEN_BY_PLAIN = {plain_name(n): remedy for n, remedy in _OPEN.items()}


def our_names(where: str, keys: Iterable[str], known: tuple[str, ...]) -> dict[str, str]:
    """Return our name of each key of a file, leaving out those in UNUSED; `known` are our names that it may hold.

    Raises InputError, beginning with `where`, if a key is unknown, or two keys mean one entry.
    """
    by_plain = {plain_name(name): name for name in known} | _BY_PLAIN
    named: dict[str, str] = {}
    for key in keys:
        if key in UNUSED:
            continue
        ours = by_plain.get(plain_name(key))
        if ours is None or ours not in known or key in _OPEN:  # capitals distinguish `t` from `T`
            raise InputError(f"{where}: unknown key '{key}'. {_remedy(plain_name(key), by_plain, known)}")
        if same := [k for k, name in named.items() if name == ours]:
            raise InputError(f"{where}: keys {same[0]} and {key} both mean {ours}. Keep one of them.")
        named[key] = ours
    return named


def _remedy(plain: str, by_plain: Mapping[str, str], known: tuple[str, ...]) -> str:
    if plain in _OPEN_BY_PLAIN:
        return f"Its meaning is open. Give {_OPEN_BY_PLAIN[plain]}."
    near = difflib.get_close_matches(plain, by_plain, n=1, cutoff=0.7)
    if near and by_plain[near[0]] in known:
        return f"Did you mean '{by_plain[near[0]]}'? If not, remove it."
    return f"Remove it, or use one of these: {', '.join(known)}."
