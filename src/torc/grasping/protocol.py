"""The protocols of grasp planners and grasp scores."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Float32

from torc.records import GraspSet, OcclusionVolume, SegmentedScene


@runtime_checkable
class GraspPlanner(Protocol):
    """Proposes grasps for the visible objects of one snapshot."""

    def plan(self, scene: SegmentedScene, volume: OcclusionVolume, rng: np.random.Generator) -> GraspSet:
        """Return candidate grasps, the best of each object first; equal inputs and generator states give equal grasps.

        Grasps whose gripper touches *other* objects may be among them: who blocks whom is decided later.
        """
        ...


@runtime_checkable
class GraspScorer(Protocol):
    """Rates candidates by their features."""

    def score(self, features: Float32[np.ndarray, "n f"]) -> Float[np.ndarray, "n"]:
        """Return the probability that the object is held after the lift; columns as in `features.FEATURE_NAMES`."""
        ...
