"""Check a problem of any origin: whether it stays at rest, is not trivial, and can be solved."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from torc.errors import InputError, PhysicsError
from torc.generation.clutter import MAX_OVERLAP_M
from torc.generation.families import scene_family
from torc.generation.inspection import Difficulty, Inspector, SceneView
from torc.oracle.solve import solve_problem
from torc.oracle.tree import DEFAULT_BUDGET, check_budget
from torc.problems.problem import Problem
from torc.registry.kinds import SCENE_FAMILIES
from torc.registry.loading import part_paths
from torc.sim.contacts import deepest_overlap
from torc.sim.settling import UNSEEN, StillnessConfig, watch_stillness
from torc.sim.simulated_world import World, build_world

FEWEST_PICKS = 2
_SAME_FRACTION = 0.02


class Check(NamedTuple):
    """One check of a problem, with the finding in words.

    Its name is "contact", "rest", "sight", "first look", "target", "surroundings" or "solution"; "absence" in place of
    the checks of an absent target; "objects" if they cannot be simulated.
    """

    name: str
    passed: bool
    text: str


@dataclass(frozen=True)
class ValidationReport:
    """The findings on a problem: checks in order; no difficulty if no look at the scene was possible."""

    problem: str
    checks: tuple[Check, ...]
    difficulty: Difficulty | None

    @property
    def valid(self) -> bool:
        return all(check.passed for check in self.checks)


Resolve = Callable[[Problem], Check]


def validate_problem(
    problem: Problem,
    inspector: Inspector,
    resolve: Resolve | None = None,
    progress: Callable[[Check], None] = lambda check: None,
    stillness: StillnessConfig | None = None,
    first_looks: int = 3,
) -> ValidationReport:
    """Check a problem as its file has it: contact, rest, sight, first look, target and surroundings.

    `resolve` also checks that it can be solved. Grasps are planned from the first look `first_looks` times, each time
    with other random candidates.
    """
    checks: list[Check] = []
    difficulty = None

    def note(name: str, passed: bool, text: str) -> None:
        checks.append(Check(name, passed, text))
        progress(checks[-1])

    try:
        world = build_world(problem, None, inspector.workspace, UNSEEN)
        overlap = deepest_overlap(world)
        deepest = f" ({' and '.join(overlap.between)})" if overlap.depth_m > 0 else ""
        depth = f"Objects are at most {1000 * overlap.depth_m:.1f} mm inside each other{deepest}."
        note("contact", overlap.depth_m <= MAX_OVERLAP_M, depth)
        note("rest", *_rest(world, stillness or StillnessConfig()))
        view = inspector.view(problem)  # the first world had no surfaces
    except InputError as error:
        note("objects", False, f"They cannot be simulated: {' '.join(str(error).split())}")
    except PhysicsError as error:
        note("rest", False, f"The simulation breaks: {error}")
    else:
        difficulty = inspector.difficulty(view, problem.target)
        for finding in _of_target(problem, view, difficulty, inspector, first_looks):
            note(*finding)
        if resolve is not None:
            note(*resolve(problem))
    return ValidationReport(problem.name, tuple(checks), difficulty)


def oracle_check(
    inspector: Inspector,
    seed: int = 0,
    budget: float = DEFAULT_BUDGET,
    say: Callable[[str], None] = lambda text: None,
) -> Resolve:
    """Return a check that the oracle finds an order of at least two picks that retrieves the target.

    It stands in for the paper's people who tried each problem: "The scene was adjusted [...] until it admitted a
    solution with a task sequence of at least two steps." (Simulated Dataset, step 5) The budget is in simulated picks.
    Raises InputError if it is not a positive number.
    """
    check_budget(budget)

    def resolve(problem: Problem) -> Check:
        try:
            answer = solve_problem(problem, inspector.system, seed, budget, say=say)
        except (InputError, PhysicsError) as error:
            return Check("solution", False, f"It cannot be played: {error}")
        order = f" The order: {', '.join(answer.order)}." if answer.solved else ""
        return Check("solution", answer.solved and answer.picks >= FEWEST_PICKS, answer.verdict() + order)

    return resolve


def _of_target(
    problem: Problem, view: SceneView, difficulty: Difficulty, inspector: Inspector, first_looks: int
) -> Iterator[Check]:
    """Check whether the target is hard to get, but possible as far as a look shows; for an absent one, whether it could
    be there.
    """
    if problem.absent:
        places = inspector.places(view)
        told = f"The target is not there; after the first look it could be in {places} poses."
        yield Check("absence", places > 0, told)
        return
    yield Check("sight", *_sight(problem, difficulty))
    trivial = inspector.graspable_at_first(view, problem.target, first_looks)
    yield Check("first look", not trivial, f"The target can{'' if trivial else 'not'} be grasped at once.")
    alone = inspector.graspable_at_all(problem, problem.target)
    yield Check(
        "target", alone, f"With nothing in the way the target can{'' if alone else 'not'} be grasped."
    )
    around = inspector.around(problem, problem.target)
    stuck = [name for name in around.all if not inspector.graspable_at_all(problem, name)]
    told = f"{len(around.all)} objects are in front of the target, beside it or taller; "
    told += f"these cannot be grasped at all: {', '.join(stuck)}." if stuck else "each can be grasped."
    family = str(problem.origin.get("family", ""))
    wanted = family in part_paths(SCENE_FAMILIES) and scene_family(family).stuck is not None
    yield Check(
        "surroundings", bool(stuck) == wanted, told + (" Some should not." if wanted and not stuck else "")
    )


def _rest(world: World, config: StillnessConfig) -> tuple[bool, str]:
    report = watch_stillness(world, config)
    names = [o.name for o in world.problem.ordered()]
    if report.left:
        gone = ", ".join(names[i] for i in report.left)
        return False, f"After {report.watched_s:g} s this is off the table: {gone}."
    return report.still, (
        f"Within {report.watched_s:g} s things move by at most {1000 * report.distance_m:.1f} mm "
        f"({names[int(np.argmax(report.distances_m))]}) and {np.rad2deg(report.angle_rad):.1f} degrees "
        f"({names[int(np.argmax(report.angles_rad))]}); allowed are {1000 * config.distance_m:g} mm and "
        f"{np.rad2deg(config.angle_rad):g} degrees."
    )


def _sight(problem: Problem, difficulty: Difficulty) -> tuple[bool, str]:
    share = f"{100 * difficulty.visible_fraction:.0f} % of the target is in sight at first"
    stated = problem.origin.get("visible_fraction")
    if isinstance(stated, int | float) and abs(stated - difficulty.visible_fraction) > _SAME_FRACTION:
        return False, f"{share}, but the file says {100 * stated:.0f} %: it was changed since."
    return True, f"{share} ({difficulty.hiddenness.value})."
