"""The factory calibration of a ZED (SN<serial>.conf), and the rectification of its pictures without the maker's SDK.

The file is an INI. Per resolution (2K, FHD, HD, VGA) it has the sections LEFT_CAM_HD and RIGHT_CAM_HD with fx, fy, cx,
cy in pixels and k1, k2, p1, p2, k3 in OpenCV's model; STEREO has Baseline, TY_HD and TZ_HD (or TY, TZ) in millimetres,
and the rotation vector RX_HD, CV_HD, RZ_HD. The maker's own calibration tool writes Baseline, TY and TZ as -t_x, t_y
and t_z of OpenCV's stereoCalibrate: a point of the left camera is R p + t in the right one's.
"""

import configparser
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from torc import InputError
from torc.io.reading import read_bytes
from torc_lab.cameras.lens import pinhole_matrix

SIZES = {"2K": (2208, 1242), "FHD": (1920, 1080), "HD": (1280, 720), "VGA": (672, 376)}
"""Width and height of one of the two pictures, by resolution."""
_MAX_BYTES = 100_000
_LENS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
_REMEDY = (
    "Fetch a complete one from https://calib.stereolabs.com/?SN=SERIAL, or calibrate the camera anew; what is missing "
    "is not taken for 0."
)
_BASELINES_MM = (20.0, 300.0)
_FEWEST_TRACKED = 30
_MOST_TURN = 0.2
"""Radians between the two cameras."""
Lens = tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "5"]]
"""Intrinsics, pixels, and k1, k2, p1, p2, k3."""


def read_calibration(
    path: Path, resolution: str
) -> tuple[Lens, Lens, Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]]:
    """Both lenses, left first, R_right_left and t_m: p_right = R_right_left @ p_left + t_m; for one of SIZES.

    Raises InputError for a file that cannot be read, lacks a value, or holds ones that cannot be.
    """
    file = configparser.ConfigParser(interpolation=None, strict=False, inline_comment_prefixes=("#", ";"))

    def number(section: str, *names: str) -> float:
        """The first of these keys that is there."""
        name = next((n for n in names if file.has_option(section, n)), names[0])
        found = file.getfloat(section, name)
        if not np.isfinite(found):
            raise ValueError(f"{name} is {found}")
        return found

    try:
        content = read_bytes(path, _MAX_BYTES, "the calibration of a ZED (SN<serial>.conf)")
        file.read_string(content.decode("utf-8-sig"))
        lenses = [[number(f"{side}_CAM_{resolution}", k) for k in _LENS] for side in ("LEFT", "RIGHT")]
        baseline_mm = number("STEREO", "Baseline")
        across_mm = [number("STEREO", f"{k}_{resolution}", k) for k in ("TY", "TZ")]
        turn = np.array([number("STEREO", f"{k}_{resolution}") for k in ("RX", "CV", "RZ")])
    except (configparser.Error, ValueError) as error:
        raise InputError(f"{path} is no complete calibration of a ZED: {error}. {_REMEDY}") from error
    if not _BASELINES_MM[0] <= baseline_mm <= _BASELINES_MM[1]:
        raise InputError(f"{path}: a Baseline of {baseline_mm:g} mm cannot be. {_REMEDY}")
    if np.linalg.norm(turn) > _MOST_TURN:
        raise InputError(f"{path}: the cameras are turned by {np.linalg.norm(turn):.2f} rad. {_REMEDY}")
    width, height = SIZES[resolution]
    for fx, fy, cx, cy, *_ in lenses:
        if not (0.2 < fx / width < 3 and 0.8 < fy / fx < 1.25 and 0 < cx < width and 0 < cy < height):
            raise InputError(
                f"{path}: fx {fx:g}, fy {fy:g}, cx {cx:g}, cy {cy:g} do not fit pictures of {width}x{height} pixels. "
                f"{_REMEDY}"
            )
    left, right = ((pinhole_matrix(*lens[:4]), np.array(lens[4:])) for lens in lenses)
    return left, right, np.asarray(cv2.Rodrigues(turn)[0]), np.array([-baseline_mm, *across_mm]) / 1000


class Rectifier:
    """Turns both pictures so that a point is in the same row of both, and takes the lenses' distortion out (Bouguet's
    method, as OpenCV's stereoRectify has it).

    Attributes:
        K: intrinsics of both rectified pictures, pixels.
        baseline_m: between them.
        R_rectified_left: from the left camera's own frame to the rectified one's.
    """

    def __init__(self, path: Path, resolution: str) -> None:
        """Raises InputError as `read_calibration`."""
        (K_left, lens_left), (K_right, lens_right), R, t_m = read_calibration(path, resolution)
        size = SIZES[resolution]
        R_left, R_right, P_left, P_right, *_ = cv2.stereoRectify(
            *(K_left, lens_left, K_right, lens_right, size, R, t_m[:, None]),
            flags=cv2.CALIB_ZERO_DISPARITY,
            alpha=0,
        )
        self.K = np.array(P_left[:, :3], float)
        self.baseline_m = float(-P_right[0, 3] / P_right[0, 0])
        self.R_rectified_left = np.array(R_left, float)
        self._maps = (
            cv2.initUndistortRectifyMap(K_left, lens_left, R_left, P_left, size, cv2.CV_16SC2),
            cv2.initUndistortRectifyMap(K_right, lens_right, R_right, P_right, size, cv2.CV_16SC2),
        )

    def rectify(
        self, left: UInt8[np.ndarray, "h w *c"], right: UInt8[np.ndarray, "h w *c"]
    ) -> tuple[UInt8[np.ndarray, "h w *c"], UInt8[np.ndarray, "h w *c"]]:
        """Both pictures, of the calibration's size, rectified."""
        found = [cv2.remap(p, *maps, cv2.INTER_LINEAR) for p, maps in zip((left, right), self._maps)]
        return np.asarray(found[0], np.uint8), np.asarray(found[1], np.uint8)


def row_difference(left: UInt8[np.ndarray, "h w"], right: UInt8[np.ndarray, "h w"]) -> float | None:
    """How many rows the same points are apart in two rectified grey pictures, as the median; None where too few points
    are found again. More than a pixel or two, and the calibration is another camera's.
    """
    starts = cv2.goodFeaturesToTrack(left, 300, 0.01, 8)
    if starts is None:
        return None
    starts = np.asarray(starts)
    there, found = _tracked(left, right, starts)
    back, again = _tracked(right, left, there)
    good = found & again & (np.linalg.norm(back - starts, axis=-1).ravel() < 0.5)
    if np.count_nonzero(good) < _FEWEST_TRACKED:
        return None
    return float(np.median(np.abs(there - starts).reshape(-1, 2)[good, 1]))


def _tracked(start: np.ndarray, end: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where points (n, 1, 2) of one picture are in another, and which were found (Lucas and Kanade 1981)."""
    there, found, _ = cv2.calcOpticalFlowPyrLK(
        start, end, points, np.zeros_like(points), winSize=(21, 21), maxLevel=5
    )
    return np.asarray(there), np.asarray(found).ravel() > 0
