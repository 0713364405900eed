"""The planner `learned`: picks the object most likely to be as good a choice as any, as it was trained.

Its weights are a logistic regression over standardised features, as plain data.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32

from torc.errors import InputError
from torc.io.record_files import load_record
from torc.records import Decision, Evidence, PlanningContext
from torc.registry.kinds import TaskPlannerTraits
from torc.task_planning.belief.belief_planner import BeliefPlanner
from torc.task_planning.learned.features import FEATURE_NAMES, REASONING, features_of

MODEL_PATH = Path(__file__).with_name("picker.npz")
_TOLD = 2
"""Number of features that a reason names."""


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
        usable = all(c.shape == (len(self.feature_names),) and np.isfinite(c).all() for c in columns)
        if not usable or not np.isfinite(self.bias) or self.scale.min(initial=1.0) <= 0:
            raise InputError(
                "A picker needs a mean, a positive scale and a weight for each feature, all finite. Train it again."
            )

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


@dataclass(frozen=True)
class LearnedConfig:
    """Configuration of the planner `learned`.

    Attributes:
        model: file of your own weights (`python -m tools.learned_picker train`); empty for the shipped ones.
    """

    model: str = ""


class LearnedPlanner(TaskPlannerTraits):
    """Ranks graspable objects by a logistic regression over what DG-SELECT and BELIEF compute."""

    name = "learned"
    reads_picture = False

    def __init__(self, config: LearnedConfig | None = None) -> None:
        """Load the model. Raises InputError if it cannot be used."""
        self.config = LearnedConfig() if config is None else config
        self.model = load_picker(Path(self.config.model) if self.config.model else MODEL_PATH)

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """Return the object that most probably no other is better than, or None if no visible one is graspable."""
        ids, features = features_of(context, rng)
        if not ids:
            return Decision(None, "No visible object has a valid grasp.")
        p, parts = self.model.score(features), self.model.parts(features)
        at = int(np.argmax(p))
        # What sets it apart from the other graspable objects.
        above = parts[at] - parts.mean(axis=0)
        most = np.argsort(-above, kind="stable")[:_TOLD]
        because = " and ".join(
            f"'{FEATURE_NAMES[i]}' {_plain(features[at, i])}" for i in most if above[i] > 0
        )
        reason = f"Pick {context.called(ids[at])}: no other is better with p = {p[at]:.2f}"
        reason += f", above all for {because}." if because else "."
        evidence = Evidence(
            "learned",
            probabilities=dict(zip(ids, p.tolist())),
            notes={"above_the_others": {FEATURE_NAMES[i]: float(above[i]) for i in most}},
        )
        return Decision(ids[at], reason, evidence=evidence)

    def warm_up(self, context: PlanningContext) -> None:
        """Run every compiled kernel once and discard the results."""
        BeliefPlanner(REASONING).warm_up(context)


def _plain(value: float) -> str:
    return "unknown" if np.isnan(value) else f"{value:.2g}"
