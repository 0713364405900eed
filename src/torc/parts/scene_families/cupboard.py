"""Things sorted by kind, the target hidden behind others of its sort."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from torc.generation.arrangements import StructuredConfig
from torc.generation.config import Hiddenness, Reason
from torc.generation.families import SceneFamily, hiders
from torc.generation.inspection import Inspector, SceneView
from torc.generation.sampling import sample_sorted, sort_of


class Cupboard(SceneFamily):
    """The object that hides the largest part of the target is of its sort."""

    category = "structured"
    hidden = Hiddenness.HIDDEN
    unseen = True

    def sample(self, count: int, rng: np.random.Generator, models: Sequence[str]) -> list[str]:
        """Return models of a few sorts."""
        return sample_sorted(count, rng, models=models)

    def arranged(self, usual: StructuredConfig) -> StructuredConfig:
        """Return an arrangement in lanes, one for each sort."""
        return replace(usual, sorted=True)

    def unfit(self, view: SceneView, target: str, inspector: Inspector) -> Reason | None:
        """Return whether something of another sort hides the target."""
        models = {o.name: o.model for o in view.problem.objects}
        in_the_way = hiders(view, target)
        if in_the_way and sort_of(models[in_the_way[0]]) == sort_of(models[target]):
            return None
        return Reason.NOT_AMONG_ITS_SORT


PART = Cupboard
