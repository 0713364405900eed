"""A ZED's pictures of a known scene, point by point through distorted lenses, and its calibration as a file."""

from pathlib import Path

import cv2
import numpy as np

from torc_lab.cameras.zed_uvc import SIZES

WIDTH, HEIGHT = SIZES["VGA"]
LEFT = {
    "fx": 351.2,
    "fy": 350.7,
    "cx": 329.4,
    "cy": 193.1,
    "k1": -0.17,
    "k2": 0.026,
    "p1": 0.0008,
    "p2": -0.0011,
}
RIGHT = {
    "fx": 349.8,
    "fy": 350.1,
    "cx": 342.7,
    "cy": 181.6,
    "k1": -0.165,
    "k2": 0.021,
    "p1": -0.0006,
    "p2": 0.0004,
}
LEFT["k3"], RIGHT["k3"] = -0.002, 0.001
STEREO = {
    "Baseline": 119.9,
    "TY_VGA": 0.31,
    "TZ_VGA": -0.42,
    "RX_VGA": -0.0042,
    "CV_VGA": 0.0085,
    "RZ_VGA": -0.0021,
}
R_RIGHT_LEFT = cv2.Rodrigues(np.array([-0.0042, 0.0085, -0.0021]))[0]
T_M = np.array([-0.1199, 0.00031, -0.00042])
PLANES = (
    (np.array([0.0, -0.6, -0.8]), -0.80),  # a table that falls away from the camera: n . p = d
    (np.array([0.0, 0.0, -1.0]), -1.30),
)
BOX = (np.array([-0.10, -0.08, 0.62]), np.array([0.08, 0.06, 0.70]))
"""Lowest and highest corner, in the left camera's frame."""


def calibration_text(stereo=None, left=None) -> str:
    """The file; entries may be changed, or left out where None."""
    sections = {
        "LEFT_CAM_VGA": LEFT | (left or {}),
        "RIGHT_CAM_VGA": RIGHT,
        "STEREO": STEREO | (stereo or {}),
    }
    lines = []
    for name, entries in sections.items():
        lines += [f"[{name}]", *(f"{k} = {v}" for k, v in entries.items() if v is not None), ""]
    return "\n".join(lines)


def write_calibration(folder: Path, **changes) -> Path:
    path = folder / "SN12345.conf"
    path.write_text(calibration_text(**changes))
    return path


def lens_of(lens) -> tuple[np.ndarray, np.ndarray]:
    """K and distortion."""
    K = np.array([[lens["fx"], 0, lens["cx"]], [0, lens["fy"], lens["cy"]], [0, 0, 1]])
    return K, np.array([lens[k] for k in ("k1", "k2", "p1", "p2", "k3")])


def raw_pixels(points: np.ndarray, side: str) -> np.ndarray:
    """Where points of the left camera's frame (n, 3) are in a raw picture: columns and rows."""
    K, distortion = lens_of(LEFT if side == "left" else RIGHT)
    R, t = (np.eye(3), np.zeros(3)) if side == "left" else (R_RIGHT_LEFT, T_M)
    return cv2.projectPoints(points, cv2.Rodrigues(R)[0], t, K, distortion)[0].reshape(-1, 2)


def hits(origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Where rays from one point meet the scene first, in the left camera's frame; (n, 3)."""
    far = np.full(len(directions), np.inf)
    for normal, d in PLANES:
        with np.errstate(divide="ignore"):
            s = (d - normal @ origin) / (directions @ normal)
        far = np.minimum(far, np.where(s > 0, s, np.inf))
    low, high = BOX
    with np.errstate(divide="ignore"):
        a, b = (low - origin) / directions, (high - origin) / directions
    enter, leave = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
    far = np.where((enter <= leave) & (enter > 0), np.minimum(far, enter), far)
    return origin + far[:, None] * directions


def side_by_side() -> np.ndarray:
    """Both raw pictures, blue first; every pixel traced back through its lens."""
    pictures = []
    for side, R, t in (("left", np.eye(3), np.zeros(3)), ("right", R_RIGHT_LEFT, T_M)):
        rows, cols = np.mgrid[:HEIGHT, :WIDTH]
        directions = _rays(cols, rows, LEFT if side == "left" else RIGHT) @ R  # R^T d
        pictures.append(_texture(hits(-R.T @ t, directions)).reshape(HEIGHT, WIDTH, 3))
    return np.hstack(pictures)


def _rays(cols, rows, lens) -> np.ndarray:
    """What pixels of a raw picture see, with z = 1; (n, 3). The distortion is undone by iteration."""
    x_raw, y_raw = (
        (c.ravel() - lens[f"c{k}"]) / lens[f"f{k}"] for c, k in ((cols.astype(float), "x"), (rows, "y"))
    )
    x, y = x_raw, y_raw
    for _ in range(40):
        r2 = x**2 + y**2
        radial = 1 + r2 * (lens["k1"] + r2 * (lens["k2"] + r2 * lens["k3"]))
        dx = 2 * lens["p1"] * x * y + lens["p2"] * (r2 + 2 * x**2)
        dy = 2 * lens["p2"] * x * y + lens["p1"] * (r2 + 2 * y**2)
        x, y = (x_raw - dx) / radial, (y_raw - dy) / radial
    return np.stack([x, y, np.ones_like(x)], axis=-1)


def _texture(points: np.ndarray) -> np.ndarray:
    """Colours of points: waves of all directions, as long as ten to thirty pixels and more."""
    rng = np.random.default_rng(5)
    waves = rng.normal(0, 260, (24, 3))
    value = np.sin(points @ waves.T + rng.uniform(0, 6, 24)).sum(axis=1)
    grey = np.clip(128 + 24 * value, 0, 255)
    return np.stack([grey, 0.9 * grey, 255 - grey], axis=-1).astype(np.uint8)
