"""The planner `learned`: picks the object most likely to be as good a choice as any, as it was trained."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from torc.records import Decision, Evidence, PlanningContext
from torc.registry.kinds import TaskPlannerTraits
from torc.task_planning.belief.belief_planner import BeliefPlanner
from torc.task_planning.learned.features import FEATURE_NAMES, REASONING, features_of
from torc.task_planning.learned.model import MODEL_PATH, load_picker

_TOLD = 2
"""Number of features that a reason names."""


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
