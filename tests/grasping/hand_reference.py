"""The gripper's volume from its description alone, opening by opening: slow, and independent of the kernels."""

import numpy as np


def in_grasp_frame(T_world_tcp, points):
    return (points - T_world_tcp[:3, 3]) @ T_world_tcp[:3, :3]


def tip_shift(gripper, opening, width):
    """How far the fingertips at an opening lie ahead of those at the grasp's width."""
    return gripper.T_tool0_tcp(opening)[2, 3] - gripper.T_tool0_tcp(width)[2, 3]


def in_boxes(points, boxes, shift_z, margin=0.0):
    inside = np.zeros(len(points), dtype=bool)
    for box in boxes:
        p = points - box.center - [0, 0, shift_z]
        inside |= np.all(np.abs(p) <= box.half_size + margin, axis=1)
    return inside


def in_swept_fingers(gripper, points, width, margin=0.0, steps=60):
    """Points (grasp frame) that a finger meets while the gripper closes from fully open to the width."""
    inside = np.zeros(len(points), dtype=bool)
    for opening in np.linspace(width, gripper.max_width_m, steps):
        shift = tip_shift(gripper, opening, width)
        inside |= in_boxes(points, gripper.finger_boxes(opening), shift, margin)
    return inside


def in_open_palm(gripper, points, width, margin=0.0):
    """Points (grasp frame) in the bounding boxes of all that is no finger, gripper open."""
    opening = gripper.max_width_m
    return in_boxes(points, gripper.palm_boxes(opening), tip_shift(gripper, opening, width), margin)


def corners(box, shift_z=0.0):
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    return box.center + signs * box.half_size + [0, 0, shift_z]
