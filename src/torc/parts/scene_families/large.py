"""Piles of many objects, under which the target lies."""

from torc.generation.config import Hiddenness, Reason
from torc.generation.families import SceneFamily, hiders
from torc.generation.inspection import Inspector, SceneView

COVERS = 0.05
"""Share of the target's pixels from which an object counts as one of many that cover it."""
COVERED_BY = 4


class Large(SceneFamily):
    """Several objects must cover the target."""

    category = "unstructured"
    objects = "30-40"
    hidden = Hiddenness.HIDDEN

    def unfit(self, view: SceneView, target: str, inspector: Inspector) -> Reason | None:
        """Return whether too few objects cover the target."""
        return Reason.NOT_COVERED if len(hiders(view, target, COVERS)) < COVERED_BY else None


PART = Large
