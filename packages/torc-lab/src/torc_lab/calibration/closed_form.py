"""A first guess of where camera and board are: Park & Martin 1994, the rotations first."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from torc.geometry.transforms import Pose, invert, make_pose


def park(pairs: Sequence[tuple[Pose, Pose]], on_hand: bool) -> tuple[Pose, Pose]:
    """Camera and board, from pairs of the flange in the base and the board in the camera.

    Returns:
        Camera in the flange and board in the base if the camera is on the hand; else camera in the base and board in
        the flange.
    """
    seen = [T for _, T in pairs]
    flanges = [T if on_hand else invert(T) for T, _ in pairs]
    T_camera = _camera(flanges, seen)
    boards = [F @ T_camera @ T for F, T in zip(flanges, seen, strict=True)]
    R_board = Rotation.from_matrix([T[:3, :3] for T in boards]).mean().as_matrix()
    return T_camera, make_pose(R_board, np.median([T[:3, 3] for T in boards], axis=0))


def _camera(flanges: Sequence[Pose], seen: Sequence[Pose]) -> Pose:
    """X with flange_i X seen_i the same for all i."""
    moves = [
        (invert(flanges[j]) @ flanges[i], seen[j] @ invert(seen[i]))
        for i in range(len(seen))
        for j in range(i + 1, len(seen))
    ]
    of_flange, of_board = (Rotation.from_matrix([m[k][:3, :3] for m in moves]).as_rotvec() for k in (0, 1))
    R = Rotation.align_vectors(of_flange, of_board)[0].as_matrix()
    left = np.concatenate([A[:3, :3] - np.eye(3) for A, _ in moves])
    right = np.concatenate([R @ B[:3, 3] - A[:3, 3] for A, B in moves])
    return make_pose(R, np.linalg.lstsq(left, right, rcond=None)[0])
