"""Refine masks so that their outlines follow the colours (GrabCut; Rother et al. 2004)."""

import cv2
import numpy as np
from jaxtyping import Bool, UInt8


def grab_cut(
    rgb: UInt8[np.ndarray, "h w 3"], marks: UInt8[np.ndarray, "h w"], rounds: int
) -> Bool[np.ndarray, "h w"]:
    """Return what belongs to the marked foreground by colour.

    `marks` are OpenCV's: GC_FGD and GC_BGD are certain, GC_PR_FGD and GC_PR_BGD a guess. They are overwritten.
    """
    cv2.setRNGSeed(0)
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(np.ascontiguousarray(rgb), marks, (0, 0, 1, 1), *models, rounds, cv2.GC_INIT_WITH_MASK)
    return np.isin(marks, (cv2.GC_FGD, cv2.GC_PR_FGD))
