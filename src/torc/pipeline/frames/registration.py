"""A colour picture that was not registered to the depth: their edges do not meet, but would elsewhere.

Depth jumps and colour edges are laid over each other, shifted and scaled. If they match far better somewhere else than
where they are, and well, the two are of different cameras. Where nothing matches, nothing is said.
"""

from collections.abc import Iterator
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8

_WIDTH_PX, _REACH_PX = 240, 36
"""Pictures are made that wide, and shifted up to that far."""
_SCALES = (
    0.6,
    0.65,
    0.7,
    0.75,
    0.8,
    0.85,
    0.9,
    0.95,
    1.0,
    1.05,
    1.1,
    1.15,
    1.2,
    1.25,
    1.3,
    1.35,
    1.4,
    1.5,
    1.6,
)
_JUMP = 0.03
"""Share of its depth that makes a step between neighbours an edge."""
_FEWEST_EDGES = 60
_HERE_PX = 3
_MATCH, _CERTAIN, _WORSE = 7.0, 6.0, 0.45
"""Heights of peaks, in standard deviations of all shifts: of a match elsewhere (good frames reach 6.3 where theirs is
less than half of that), of a match in place that ends the search, and how much lower that in place has to be."""

Edges = tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]
"""Strength of edges along the columns (steps in x), and along the rows."""


class _Match(NamedTuple):
    """Where depth edges match colour edges best: height of the peak, scale of the depth about the picture's middle, and
    shift, in small pixels."""

    peak: float
    scale: float
    shift_px: tuple[int, int]
    mirrored: str = ""


def registration_doubt(rgb: UInt8[np.ndarray, "h w 3"], depth_m: Float32[np.ndarray, "h w"]) -> str:
    """Whether the colour edges match the depth edges well, but elsewhere."""
    height_px = round(depth_m.shape[0] * _WIDTH_PX / depth_m.shape[1])
    depth, color = _depth_edges(depth_m, height_px), _color_edges(rgb, height_px)
    if sum(e.sum() for e in depth) < _FEWEST_EDGES:
        return ""
    here = _peaks(depth, color, 1.0)
    if here is None:
        return ""
    r, t = _REACH_PX, _HERE_PX
    around = (slice(r - t, r + t + 1),) * 2
    in_place = float(here[around].max())
    if in_place >= _CERTAIN:
        return ""
    here[around] = 0.0
    best = max(_elsewhere(depth, color, here), key=lambda match: match.peak)
    if best.peak < _MATCH or in_place > _WORSE * best.peak:
        return ""
    return (
        f"The colour picture seems not registered to the depth: their edges would meet {_how(best, rgb.shape)}"
        ". Align the two (RealSense: rs.align(rs.stream.color); ROS: a topic such as aligned_depth_to_color)."
    )


def _how(match: _Match, shape: tuple[int, ...]) -> str:
    if match.mirrored:
        return f"if one of them were {match.mirrored}"
    dx, dy = (round(n * shape[1] / _WIDTH_PX) for n in match.shift_px)
    scaled = "" if match.scale == 1 else f"scaled by {match.scale:g} and "
    return f"with the depth {scaled}shifted by {dx} pixels along x and {dy} along y"


def _elsewhere(depth: Edges, color: Edges, here: Float[np.ndarray, "m m"]) -> Iterator[_Match]:
    """The best match at each scale, and mirrored; `here` has the peaks of unscaled edges."""
    yield _match(here, 1.0)
    for scale in _SCALES:
        found = None if scale == 1 else _peaks(depth, color, scale)
        if found is not None:
            yield _match(found, scale)
    for name, (y, x) in {
        "mirrored": (1, -1),
        "upside down": (-1, 1),
        "turned by 180 degrees": (-1, -1),
    }.items():
        turned = tuple(np.ascontiguousarray(e[::y, ::x]) for e in color)
        found = _peaks(depth, (turned[0], turned[1]), 1.0)
        if found is not None:
            yield _match(found, 1.0, name)


def _match(peaks: Float[np.ndarray, "m m"], scale: float, mirrored: str = "") -> _Match:
    row, col = np.unravel_index(int(peaks.argmax()), peaks.shape)
    return _Match(float(peaks.max()), scale, (int(col) - _REACH_PX, int(row) - _REACH_PX), mirrored)


def _peaks(depth: Edges, color: Edges, scale: float) -> Float[np.ndarray, "m m"] | None:
    """How well the depth's edges, scaled, match per shift, in standard deviations above the surroundings; None if too
    few edges are left.
    """
    r, shape = _REACH_PX, depth[0].shape
    total = seen = np.zeros(1, np.float32)
    ones = cv2.copyMakeBorder(np.ones(shape, np.float32), r, r, r, r, cv2.BORDER_CONSTANT, value=0)
    for edges, strength in zip(depth, color):
        template = _scaled(edges, scale)
        wide = cv2.copyMakeBorder(strength, r, r, r, r, cv2.BORDER_CONSTANT, value=0)
        total = total + cv2.matchTemplate(wide, template, cv2.TM_CCORR)
        seen = seen + cv2.matchTemplate(ones, template, cv2.TM_CCORR)
    if seen.max() < _FEWEST_EDGES:
        return None
    inside = seen > 0.6 * seen.max()
    mean = np.where(inside, total / np.maximum(seen, 1), 0).astype(np.float32)
    mean[~inside] = mean[inside].mean()
    side = _WIDTH_PX // 12 | 1
    local = mean - cv2.blur(mean, (side, side))
    return np.asarray(local / max(float(local.std()), 1e-9), dtype=float)


def _scaled(edges: Float32[np.ndarray, "h w"], scale: float) -> Float32[np.ndarray, "h w"]:
    """Edge pixels moved away from the picture's middle, or towards it; what leaves the picture is lost."""
    middle = np.array(edges.shape) / 2
    moved = np.round((np.argwhere(edges) - middle) * scale + middle).astype(int)
    inside = ((moved >= 0) & (moved < edges.shape)).all(axis=1)
    out = np.zeros_like(edges)
    out[tuple(moved[inside].T)] = 1
    return out


def _color_edges(rgb: UInt8[np.ndarray, "h w 3"], height_px: int) -> Edges:
    """Gradients of the colour, relative to those around."""
    image = cv2.resize(rgb, (_WIDTH_PX, height_px), interpolation=cv2.INTER_AREA)
    lab = cv2.cvtColor(image, cv2.COLOR_RGB2LAB).astype(np.float32)
    across, down = (np.abs(cv2.Sobel(lab, cv2.CV_32F, *d)).max(axis=-1) for d in ((1, 0), (0, 1)))
    side = _WIDTH_PX // 5 | 1
    around = cv2.blur(np.hypot(across, down), (side, side)) + np.float32(0.5)
    return np.minimum(across / around, 3), np.minimum(down / around, 3)


def _depth_edges(depth_m: Float32[np.ndarray, "h w"], height_px: int) -> Edges:
    """1 on the nearer side of each jump of the depth, not at the picture's border."""
    small = cv2.resize(depth_m, (_WIDTH_PX, height_px), interpolation=cv2.INTER_NEAREST)
    return _jumps(small), np.ascontiguousarray(_jumps(small.T).T)


def _jumps(depth_m: Float32[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w"]:
    """1 on the nearer side of each jump along a row."""
    a, b = depth_m[:, :-1], depth_m[:, 1:]
    jump = (a > 0) & (b > 0) & (np.abs(a - b) > _JUMP * np.minimum(a, b))
    out = np.zeros_like(depth_m)
    out[:, :-1][jump & (a <= b)] = 1
    out[:, 1:][jump & (b < a)] = 1
    out[:2] = out[-2:] = out[:, :2] = out[:, -2:] = 0
    return out
