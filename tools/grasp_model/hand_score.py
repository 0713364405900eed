"""A score of grasps written by hand: the baseline that a trained one must beat."""

import numpy as np
from jaxtyping import Float, Float32

from torc.grasping.features import FEATURE_NAMES

# (feature, value that counts as 0, value that counts as 1, weight in log-odds)
_TERMS = (
    ("all_aligned_min", 0.0, 8.0, 1.6),
    ("seen_aligned_max", 0.0, 8.0, 0.5),
    ("all_contacts_min", 0.0, 10.0, 0.6),
    ("alignment_min", 0.3, 0.95, 0.7),
    ("extent_z", 0.0, 0.017, 0.7),
    ("extent_y", 0.0, 0.018, 0.5),
    ("penetration", 0.005, 0.030, 0.8),
    ("wider_beyond", 0.0, 0.012, -0.8),
    ("lever", 0.005, 0.070, -1.4),
    ("off_center_x", 0.002, 0.020, -0.8),
    ("closing_vertical", 0.1, 0.8, -1.0),
    ("closing_view", 0.3, 1.0, -0.7),
    ("unknown_finger_other", 0.0, 0.6, -0.4),
    ("foreign_near", 0.0, 12.0, -0.4),
    ("foreign_corridor", 0.0, 10.0, -0.5),
    ("log_foreign_above", 2.0, 5.3, -0.9),
    ("foreign_fingers", 0.0, 6.0, -1.2),
    ("foreign_palm", 0.0, 6.0, -1.2),
    ("foreign_between", 1.0, 10.0, -1.2),
)
_BIAS = -1.6


class HandScore:
    """A log-odds sum of clipped terms."""

    def __init__(self) -> None:
        self._columns = np.array([FEATURE_NAMES.index(name) for name, *_ in _TERMS])
        self._low = np.array([low for _, low, _, _ in _TERMS])
        self._range = np.array([high - low for _, low, high, _ in _TERMS])
        self._weight = np.array([weight for *_, weight in _TERMS])

    def score(self, features: Float32[np.ndarray, "n f"]) -> Float[np.ndarray, "n"]:
        """Something like a probability per row, 0..1."""
        x = np.clip((features[:, self._columns].astype(float) - self._low) / self._range, 0.0, 1.0)
        return 1.0 / (1.0 + np.exp(-(_BIAS + x @ self._weight)))
