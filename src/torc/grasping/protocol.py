"""The protocols of grasp planners and grasp scores, and how a planner is asked: what it returns is checked."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Float32

from torc.errors import GraspPlannerError
from torc.records import GraspSet, OcclusionVolume, SegmentedScene
from torc.registry.loading import blamed, kind_of_value

_HELP = "torc.testing.grasp_conformance checks a grasp planner against all rules (docs/extending.md)."
_SHAPES = {
    "Ts_world_tcp": (4, 4),
    "widths_m": (),
    "scores": (),
    "object_ids": (),
    "contacts": (2, 3),
    "generators": (),
}
_KINDS = {**dict.fromkeys(_SHAPES, np.float64), "object_ids": np.int16, "generators": np.uint8}
_ROTATION_TOLERANCE = 1e-4


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
        """Return the probability that the object is held after the lift; columns as in `features.FEATURE_NAMES`.

        Called for several objects at once, from threads of their own.
        """
        ...


def ask_grasp_planner(
    planner: GraspPlanner, scene: SegmentedScene, volume: OcclusionVolume, rng: np.random.Generator
) -> GraspSet:
    """Return the planner's grasps, in arrays of the types that kernels expect.

    Raises GraspPlannerError if the planner crashed or gave no valid set of grasps for this scene.
    """
    what = f"Grasp planner {type(planner).__name__}"
    with blamed(what, GraspPlannerError, _HELP):
        grasps: Any = planner.plan(scene, volume, rng)
    for fault in grasp_faults(grasps, scene):
        raise GraspPlannerError(f"{what} gave no valid grasps: {fault}. {_HELP}")
    kinds = {name: np.ascontiguousarray(getattr(grasps, name), kind) for name, kind in _KINDS.items()}
    return replace(grasps, **kinds)


def grasp_faults(grasps: Any, scene: SegmentedScene) -> Iterator[str]:
    """Yield why something is not a valid set of grasps for a scene; later reasons may depend on earlier ones."""
    if not isinstance(grasps, GraspSet):
        yield f"plan() returned {kind_of_value(grasps)}, not a torc.records.GraspSet"
        return
    shapes = list(_shape_faults(grasps))
    yield from shapes
    if shapes or not len(grasps):
        return
    unknown = sorted(set(grasps.object_ids.tolist()) - set(scene.ids))
    if unknown:
        yield f"it has grasps for objects {unknown}, but the scene shows only {list(scene.ids)}"
    if not ((grasps.scores >= 0) & (grasps.scores <= 1)).all():
        yield "scores must be probabilities, 0 to 1"
    if not (grasps.widths_m >= 0).all():
        yield "widths_m must not be negative"
    R = grasps.Ts_world_tcp[:, :3, :3]
    rigid = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max() < _ROTATION_TOLERANCE
    if not (rigid and (np.linalg.det(R) > 0).all() and (grasps.Ts_world_tcp[:, 3] == [0, 0, 0, 1]).all()):
        yield "Ts_world_tcp must be rigid transforms: a rotation, a position, and 0 0 0 1"
    if grasps.generators.max() >= len(grasps.generator_names):
        yield "generators must be indices into generator_names"


def _shape_faults(grasps: GraspSet) -> Iterator[str]:
    """Yield columns that are not arrays of numbers with one row per grasp."""
    count = np.shape(grasps.scores)[:1]
    for name, shape in _SHAPES.items():
        column = getattr(grasps, name)
        whole = name in ("object_ids", "generators")
        if not isinstance(column, np.ndarray) or column.shape != (*count, *shape):
            found = column.shape if isinstance(column, np.ndarray) else kind_of_value(column)
            yield f"{name} must be an array of shape ({', '.join(['grasps', *map(str, shape)])}), not {found}"
        elif not np.issubdtype(column.dtype, np.integer if whole else np.floating):
            yield f"{name} must hold {'whole numbers' if whole else 'floats'}, not {column.dtype}"
        elif not whole and not np.isfinite(column).all():
            yield f"{name} must be finite"
    if not (
        isinstance(grasps.generator_names, tuple) and all(isinstance(n, str) for n in grasps.generator_names)
    ):
        yield "generator_names must be a tuple of names"
