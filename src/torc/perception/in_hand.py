"""Find the pixels of what the gripper holds, by the arm's joints and by what stayed where it was."""

import cv2
import numpy as np
from jaxtyping import Bool, Float32, UInt8

from torc.geometry.transforms import invert, unproject
from torc.perception.target import grab_cut
from torc.records import Observation
from torc.robots.description import RobotDescription
from torc.robots.kinematics import sphere_centers, tcp_pose

_ASIDE_M, _BEHIND_M, _BEYOND_M = 0.30, 0.20, 0.35
"""The held object lies within this box about the TCP: to the sides, against the approach, along it. A bottle held at
its neck reaches far.
"""
_ROBOT_M = 0.004
"""A point this close to the robot's shape is the robot's."""
_STAYED_M, _STAYED_SHARE = 0.008, 0.012
"""A surface is where it was if the depth is this close to the earlier one, or within this share of it."""
_JUMP_M = 0.02
"""Neighbouring pixels further apart in depth show two surfaces."""
_SEED_M, _LEAST_SEEDS = 0.05, 8
"""The held object has at least this many pixels this close to the TCP."""
_LEAST_PX = 40
_CORE_PX, _RIM_PX = 7, 9
"""Colour decides from half of the first inside the outline by depth to half of the second outside."""
_LEAST_SHARE = 0.3
"""If colour leaves a smaller share of the mask by depth, depth alone decides."""


def held_mask(
    observation: Observation,
    before_m: Float32[np.ndarray, "h w"],
    robot: RobotDescription,
    width_m: float,
    rough: bool = False,
) -> Bool[np.ndarray, "h w"]:
    """Return the pixels of what is between the fingers: near the TCP, not the robot, and not there before.

    No pixels if it cannot be seen. `before_m` is this camera's depth before the pick: 0 for no reading, and where
    the object itself was, since a box that is lifted along its front shows an unchanged depth there. `width_m` is the
    gripper's opening. If depth is `rough`, with a sensor's errors, colour decides the outline.
    """
    depth = np.nan_to_num(observation.depth_m)
    near = np.maximum(_STAYED_M, _STAYED_SHARE * depth)
    stayed = (before_m > 0) & (np.abs(depth - np.nan_to_num(before_m)) < near)
    rows, cols = np.nonzero((depth > 0) & ~stayed)
    z = depth[rows, cols].astype(np.float64)
    points = unproject(rows, cols, z, observation.K, observation.T_world_camera)
    T = invert(tcp_pose(robot, observation.qpos, width_m))
    local = points @ T[:3, :3].T + T[:3, 3]
    inside = (np.abs(local[:, :2]) < _ASIDE_M).all(axis=1)
    inside &= (local[:, 2] > -_BEHIND_M) & (local[:, 2] < _BEYOND_M)
    rows, cols, points, local = rows[inside], cols[inside], points[inside], local[inside]
    free = np.ones(len(points), bool)
    centers = sphere_centers(robot, observation.qpos[None], np.array([width_m]))[0]
    for center, radius in zip(centers, robot.spheres.radii, strict=True):
        free &= ((points - center) ** 2).sum(axis=1) >= (radius + _ROBOT_M) ** 2
    mask = np.zeros(depth.shape, bool)
    mask[rows[free], cols[free]] = True
    seeds = free & (np.linalg.norm(local, axis=1) < _SEED_M)
    found = _pieces(mask, depth, rows[seeds], cols[seeds])
    if rough and found.any():
        other = stayed.copy()
        other[rows[~free], cols[~free]] = True
        found = _by_color(observation.rgb, found, other)
    return found if np.count_nonzero(found) >= _LEAST_PX else np.zeros_like(mask)


def _pieces(
    mask: Bool[np.ndarray, "h w"], depth: Float32[np.ndarray, "h w"], rows: np.ndarray, cols: np.ndarray
) -> Bool[np.ndarray, "h w"]:
    """Return the pieces of the mask that hold enough of these pixels: fingers in front divide what they hold."""
    square = np.ones((3, 3), np.uint8)
    nearest = cv2.erode(np.where(mask, depth, np.float32(np.inf)), square)
    farthest = cv2.dilate(np.where(mask, depth, np.float32(0)), square)
    whole = mask & (farthest - nearest < _JUMP_M)
    count, piece = cv2.connectedComponents(whole.view(np.uint8), connectivity=4)
    seeds = np.bincount(piece[rows, cols], minlength=count)
    seeds[0] = 0
    found = (seeds >= _LEAST_SEEDS)[piece]
    # The rim of a piece is beside a jump, but belongs to it.
    return np.asarray(mask & (cv2.dilate(found.view(np.uint8), square) > 0))


def _by_color(
    rgb: UInt8[np.ndarray, "h w 3"], found: Bool[np.ndarray, "h w"], other: Bool[np.ndarray, "h w"]
) -> Bool[np.ndarray, "h w"]:
    """Move the mask's outline to where the colour changes; `other` is certainly something else."""
    rows, cols = np.nonzero(found)
    box = tuple(slice(max(int(v.min()) - _RIM_PX, 0), int(v.max()) + _RIM_PX + 1) for v in (rows, cols))
    inside, outside = found[box].view(np.uint8), other[box] & ~found[box]
    marks = np.full(inside.shape, cv2.GC_BGD, np.uint8)
    marks[cv2.dilate(inside, np.ones((_RIM_PX, _RIM_PX), np.uint8)) > 0] = cv2.GC_PR_BGD
    marks[outside] = cv2.GC_BGD
    marks[inside > 0] = cv2.GC_PR_FGD
    marks[cv2.erode(inside, np.ones((_CORE_PX, _CORE_PX), np.uint8)) > 0] = cv2.GC_FGD
    out = np.zeros_like(found)
    out[box] = grab_cut(rgb[box], marks, rounds=3)
    return out if np.count_nonzero(out) >= _LEAST_SHARE * np.count_nonzero(found) else found
