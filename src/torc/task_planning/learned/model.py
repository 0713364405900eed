"""The learned picker's weights: a logistic regression over standardised features, as plain data."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32

from torc.errors import InputError
from torc.io.record_files import load_record
from torc.task_planning.learned.features import FEATURE_NAMES

MODEL_PATH = Path(__file__).with_name("picker.npz")


@dataclass(frozen=True)
class PickerModel:
    """The log-odds that no other object is a better choice: bias + weights . (features - mean) / scale.

    An unknown feature counts as its mean.

    Attributes:
        notes: how it was trained, for people.
    """

    feature_names: tuple[str, ...]
    mean: Float[np.ndarray, "f"]
    scale: Float[np.ndarray, "f"]
    weights: Float[np.ndarray, "f"]
    bias: float
    notes: str = ""

    def __post_init__(self) -> None:
        columns = self.mean, self.scale, self.weights
        if any(c.shape != (len(self.feature_names),) for c in columns):
            raise InputError("A picker needs a mean, a scale and a weight for each feature. Train it again.")
        if not all(np.isfinite(c).all() for c in columns) or not np.isfinite(self.bias):
            raise InputError("A picker's numbers must be finite. Train it again.")
        if self.scale.min(initial=1.0) <= 0:
            raise InputError("A picker's scales must be positive. Train it again.")

    def parts(self, features: Float32[np.ndarray, "k f"]) -> Float[np.ndarray, "k f"]:
        """Return what each feature adds to the log-odds."""
        standard = (features.astype(float) - self.mean) / self.scale
        return np.where(np.isnan(standard), 0.0, standard) * self.weights

    def score(self, features: Float32[np.ndarray, "k f"]) -> Float[np.ndarray, "k"]:
        """Return the probability of each object, on its own, that no other is a better choice."""
        return 1 / (1 + np.exp(-(self.bias + self.parts(features).sum(axis=1))))


def load_picker(path: Path) -> PickerModel:
    """Load a model for the features of this version. Raises InputError for any other file."""
    model = load_record(path, PickerModel)
    if model.feature_names != FEATURE_NAMES:
        odd = sorted(set(model.feature_names) ^ set(FEATURE_NAMES)) or ["the same, in another order"]
        raise InputError(f"{path} was trained on other features ({', '.join(odd[:5])}). Train it again.")
    return model
