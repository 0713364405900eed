"""Scenes to try grasps in: arrangements and piles of library objects, settled; later ones with objects taken away."""

from dataclasses import dataclass, replace

import numpy as np

from torc.errors import InputError, PhysicsError
from torc.generation.arrangements import StructuredConfig, drop_arrangement, structured_arrangement
from torc.generation.sampling import sample_models
from torc.problems.problem import ObjectPlacement, Problem
from torc.problems.schema import Category
from torc.sim.settling import SettleReport, dump, settle_problem
from torc.workspace.description import Workspace


@dataclass(frozen=True)
class SceneConfig:
    """What scenes are made of.

    Attributes:
        min_objects, max_objects: how many.
        structured_share: share of arrangements of standing objects; the others are dumped piles.
        unseen_share: in scenes with kinds unseen in training, the share of objects of such kinds.
        tries: arrangements tried until one settles.
    """

    min_objects: int = 6
    max_objects: int = 16
    structured_share: float = 0.5
    unseen_share: float = 0.5
    tries: int = 4


def make_scene(
    rng: np.random.Generator, workspace: Workspace, unseen_kinds: bool, config: SceneConfig
) -> Problem | None:
    """A settled scene, or None if none of the tries came to rest with enough objects on the table.

    Without `unseen_kinds` the kinds that the library holds out from training do not occur.
    """
    structured = bool(rng.random() < config.structured_share)
    for _ in range(config.tries):
        names = draw_models(rng, unseen_kinds, config)
        try:
            problem, report = (
                _arranged(names, rng, workspace) if structured else _piled(names, rng, workspace)
            )
        except (PhysicsError, InputError):
            continue  # fell apart, or did not fit onto the table
        problem = without(problem, [problem.ordered()[i].name for i in report.left])
        if report.settled and len(problem.objects) >= config.min_objects:
            return problem
    return None


def draw_models(rng: np.random.Generator, unseen_kinds: bool, config: SceneConfig) -> list[str]:
    """Model names; some of kinds held out from training if `unseen_kinds`, none of them otherwise."""
    count = int(rng.integers(config.min_objects, config.max_objects + 1))
    unseen = round(config.unseen_share * count) if unseen_kinds else 0
    names = [*sample_models(unseen, rng, held_out=True), *sample_models(count - unseen, rng, held_out=False)]
    return [str(n) for n in rng.permutation(names)]


def without(problem: Problem, names: list[str]) -> Problem:
    """The problem with some placements taken away; if the target is among them another becomes it."""
    rest = tuple(o for o in problem.objects if o.name not in names)
    target = problem.target if problem.target not in names else (rest[0].name if rest else "")
    return replace(problem, objects=rest, target=target)


def take_away(problem: Problem, names: list[str], workspace: Workspace) -> Problem | None:
    """The scene after some objects were taken away and the others came to rest; None if they did not."""
    try:
        settled, report = settle_problem(without(problem, names), workspace)
    except PhysicsError:
        return None
    rest = without(settled, [settled.ordered()[i].name for i in report.left])
    return rest if report.settled and rest.objects else None


def _arranged(
    names: list[str], rng: np.random.Generator, workspace: Workspace
) -> tuple[Problem, SettleReport]:
    """Objects standing side by side, from shoulder to shoulder to a hand's breadth apart, some turned at random."""
    config = StructuredConfig(
        support_z_m=workspace.support_z_m,
        turned_rad=float(rng.choice([0.3, 1.5])),
        gap_m=(0.005, float(rng.choice([0.02, 0.06]))),
        restarts=4,
    )
    objects = tuple(structured_arrangement(names, rng, config))
    return settle_problem(_problem("structured", objects), workspace)


def _piled(names: list[str], rng: np.random.Generator, workspace: Workspace) -> tuple[Problem, SettleReport]:
    return dump(_problem("unstructured", tuple(drop_arrangement(names, rng))), workspace, rng)


def _problem(category: Category, objects: tuple[ObjectPlacement, ...]) -> Problem:
    return Problem("training", category, "", objects[0].name, objects)
