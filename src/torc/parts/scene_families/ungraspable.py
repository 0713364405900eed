"""Something before the target cannot be grasped at all: the order has to go round it."""

from dataclasses import replace

import numpy as np

from torc.generation.arrangements import StructuredConfig
from torc.generation.families import SceneFamily


class Ungraspable(SceneFamily):
    """Boxes often lie on their backs, however wide they are then."""

    stuck = 1

    def arranged(self, usual: StructuredConfig) -> StructuredConfig:
        """Return an arrangement with such boxes."""
        return replace(usual, lying=0.6, lying_width_m=np.inf)


PART = Ungraspable
