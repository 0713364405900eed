"""Score masks against the true ones by the measures of the OCID and OSD evaluations (Xie et al. 2021, UOIS).

Masks are matched to true objects so that the sum of their F is largest. Overlap: pixels in common, against all pixels
of the masks (precision) and of the true objects (recall). Boundary: likewise for outlines, one of which may be a few
pixels off. F@.75: the share of true objects whose match has an overlap F of at least .75. A picture's numbers are
averaged over pictures. In addition: merges, masks that hold most of two or more objects; splits, objects of which two
or more masks hold a quarter each; and missed objects, of which no mask holds a quarter.
"""

from dataclasses import astuple, dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Int16
from scipy.optimize import linear_sum_assignment

_BOUNDARY_SHARE = 0.003
"""Outlines may be this share of the picture's diagonal apart."""
_SURE_F = 0.75
_MOST, _PART, _NOTHING = 0.5, 0.25, 0.25


@dataclass(frozen=True)
class MaskScore:
    """One picture's measures, or the mean of several; shares from 0 to 1.

    `merges` are per mask, `splits` and `missed` per true object.
    """

    overlap_p: float
    overlap_r: float
    overlap_f: float
    boundary_p: float
    boundary_r: float
    boundary_f: float
    f75: float
    merges: float
    splits: float
    missed: float


def score_masks(found: Int16[np.ndarray, "h w"], true: Int16[np.ndarray, "h w"]) -> MaskScore:
    """Compare two label images; labels below 0 are not objects."""
    f_ids, t_ids = np.unique(found[found >= 0]), np.unique(true[true >= 0])
    if len(f_ids) == 0 or len(t_ids) == 0:
        # As the published evaluations do: finding nothing where nothing is, is right.
        p, r = float(len(f_ids) == 0), float(len(t_ids) == 0)
        return MaskScore(p, r, p * r, p, r, p * r, r, 0.0, 0.0, 1 - r)
    common = np.array([[np.count_nonzero((found == f) & (true == t)) for t in t_ids] for f in f_ids], float)
    f_size = np.array([np.count_nonzero(found == f) for f in f_ids], float)
    t_size = np.array([np.count_nonzero(true == t) for t in t_ids], float)
    f_measure = 2 * common / (f_size[:, None] + t_size)
    rows, cols = linear_sum_assignment(-f_measure)
    hits = common[rows, cols].sum()
    overlap = _prf(hits, hits, f_size.sum(), t_size.sum())
    return MaskScore(
        *overlap,
        *_boundary(found, true, list(zip(f_ids[rows], t_ids[cols])), f_ids, t_ids),
        f75=float(np.count_nonzero(f_measure[rows, cols] >= _SURE_F) / len(t_ids)),
        merges=float(np.mean((common >= _MOST * t_size).sum(axis=1) >= 2)),
        splits=float(np.mean((common >= _PART * t_size).sum(axis=0) >= 2)),
        missed=float(np.mean(common.max(axis=0) < _NOTHING * t_size)),
    )


def mean_score(scores: list[MaskScore]) -> MaskScore:
    """Return the mean over pictures. Raises ValueError if there are none."""
    if not scores:
        raise ValueError("There is no score to average.")
    return MaskScore(*(float(v) for v in np.mean([astuple(s) for s in scores], axis=0)))


def _prf(hits_found: float, hits_true: float, found: float, true: float) -> tuple[float, float, float]:
    p, r = float(hits_found / max(found, 1)), float(hits_true / max(true, 1))
    return p, r, 2 * p * r / max(p + r, 1e-12)


def _boundary(
    found: np.ndarray, true: np.ndarray, matches: list[tuple[int, int]], f_ids: np.ndarray, t_ids: np.ndarray
) -> tuple[float, float, float]:
    radius = int(np.ceil(_BOUNDARY_SHARE * np.hypot(*true.shape)))
    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))
    f_lines = {int(i): outline(found == i) for i in f_ids}
    t_lines = {int(i): outline(true == i) for i in t_ids}
    pairs = [(f_lines[int(f)], t_lines[int(t)]) for f, t in matches]
    hits_f = sum(int(np.count_nonzero(f & (cv2.dilate(t.view(np.uint8), disk) > 0))) for f, t in pairs)
    hits_t = sum(int(np.count_nonzero(t & (cv2.dilate(f.view(np.uint8), disk) > 0))) for f, t in pairs)
    total_f, total_t = (sum(map(np.count_nonzero, lines.values())) for lines in (f_lines, t_lines))
    return _prf(hits_f, hits_t, total_f, total_t)


def outline(mask: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    """Return the pixels of a mask next to pixels outside it; the picture's edge does not count."""
    grown = cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8), borderType=cv2.BORDER_REPLICATE)
    return mask & (grown == 0)
