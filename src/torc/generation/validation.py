"""Checking a problem, whoever made it: does it stay as it is, is it no trivial one, can it be solved."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from torc.errors import InputError, PhysicsError
from torc.generation.clutter import MAX_OVERLAP_M
from torc.generation.difficulty import Difficulty, measure_difficulty
from torc.generation.inspection import Inspector, SceneView
from torc.generation.surroundings import Surroundings
from torc.problems.problem import Problem
from torc.sim.contacts import deepest_overlap
from torc.sim.settling import UNSEEN
from torc.sim.stillness import StillnessConfig, watch_stillness
from torc.sim.world import World, build_world

_SAME_FRACTION = 0.02
_NOTHING_M, _NOTHING_RAD = 5e-5, 1e-3


@dataclass(frozen=True)
class Check:
    """One thing that was checked.

    Attributes:
        name: one word: "contact", "rest", "sight", "first look", "target", "surroundings", or of a re-solving step;
            "objects" where they cannot be simulated.
        passed: whether a valid problem looks like that.
        text: what was found, in words.
    """

    name: str
    passed: bool
    text: str


@dataclass(frozen=True)
class ValidationReport:
    """What was found of a problem.

    Attributes:
        problem: its name.
        checks: in the order in which they were made.
        difficulty: None if the scene could not be looked at.
    """

    problem: str
    checks: tuple[Check, ...]
    difficulty: Difficulty | None

    @property
    def valid(self) -> bool:
        """Every check passed."""
        return all(check.passed for check in self.checks)


@dataclass(frozen=True)
class ValidationConfig:
    """How a problem is checked.

    Attributes:
        stillness: how far what may move, for how long.
        first_looks: how many times grasps are planned from the first look, each with other random candidates.
    """

    stillness: StillnessConfig = field(default_factory=StillnessConfig)
    first_looks: int = 3


Resolve = Callable[[Problem], Check]
"""Solves a problem again and says how that went."""


def validate_problem(
    problem: Problem,
    inspector: Inspector,
    config: ValidationConfig | None = None,
    resolve: Resolve | None = None,
    progress: Callable[[Check], None] | None = None,
) -> ValidationReport:
    """Checks a problem: contact, rest, sight, first look, target, surroundings, and if wanted solves it again.

    Args:
        problem: as its file has it; nothing is moved before the checks.
        inspector: the robot that has to solve it.
        config: how strictly.
        resolve: solves the problem again; without it that is not checked.
        progress: told each check as it is made.
    """
    config = config or ValidationConfig()
    checks: list[Check] = []

    def note(check: Check) -> None:
        checks.append(check)
        if progress is not None:
            progress(check)

    def ended(check: Check) -> ValidationReport:
        note(check)
        return ValidationReport(problem.name, tuple(checks), None)

    try:
        world = build_world(problem, None, inspector.workspace, UNSEEN)
    except InputError as error:
        return ended(_unusable(error))
    note(_contact(world))
    try:
        note(_rest(world, config.stillness))
    except PhysicsError as error:
        return ended(Check("rest", False, f"The simulation breaks: {error}"))
    try:
        view = inspector.view(problem)
    except InputError as error:  # the first world had no surfaces
        return ended(_unusable(error))
    around = inspector.around(problem, problem.target)
    difficulty = measure_difficulty(inspector, view, problem.target, around)
    for check in _looks(problem, view, around, difficulty, inspector, config):
        note(check)
    if resolve is not None:
        note(resolve(problem))
    return ValidationReport(problem.name, tuple(checks), difficulty)


def _unusable(error: InputError) -> Check:
    return Check("objects", False, f"They cannot be simulated: {' '.join(str(error).split())}")


def _contact(world: World) -> Check:
    overlap = deepest_overlap(world)
    depth = f"{1000 * overlap.depth_m:.1f} mm"
    if overlap.depth_m > MAX_OVERLAP_M:
        return Check("contact", False, f"{' and '.join(overlap.between)} are {depth} inside each other.")
    return Check("contact", True, f"Nothing is inside anything else (at most {depth}).")


def _rest(world: World, config: StillnessConfig) -> Check:
    report = watch_stillness(world, config)
    names = [o.name for o in world.problem.ordered()]
    far, turned = int(np.argmax(report.distances_m)), int(np.argmax(report.angles_rad))
    most = (
        f"{1000 * report.distance_m:.1f} mm ({names[far]}) and "
        f"{np.rad2deg(report.angle_rad):.1f} degrees ({names[turned]})"
    )
    allowed = f"{1000 * config.distance_m:g} mm and {np.rad2deg(config.angle_rad):g} degrees"
    if report.left:
        gone = ", ".join(names[i] for i in report.left)
        return Check("rest", False, f"After {report.watched_s:g} s this is off the table: {gone}.")
    if not report.still:
        return Check(
            "rest", False, f"Within {report.watched_s:g} s things move by {most}; allowed are {allowed}."
        )
    still = report.distance_m < _NOTHING_M and report.angle_rad < _NOTHING_RAD
    return Check(
        "rest", True, f"In {report.watched_s:g} s nothing moves{'' if still else f' by more than {most}'}."
    )


def _looks(
    problem: Problem,
    view: SceneView,
    around: Surroundings,
    difficulty: Difficulty,
    inspector: Inspector,
    config: ValidationConfig,
) -> Iterator[Check]:
    yield _sight(problem, difficulty)
    trivial = inspector.graspable_at_first(view, problem.target, config.first_looks)
    yield Check(
        "first look",
        not trivial,
        "The target can be grasped at once, with everything in place: no task to plan."
        if trivial
        else "The target cannot be grasped at once.",
    )
    alone = inspector.graspable_at_all(problem, problem.target)
    yield Check(
        "target",
        alone,
        "With nothing in the way the robot can grasp the target."
        if alone
        else "Even with nothing else on the table the robot finds no grasp of the target.",
    )
    stuck = [name for name in around.all if not inspector.graspable_at_all(problem, name)]
    yield Check(
        "surroundings",
        not stuck,
        f"Of the {len(around.all)} objects around the target these cannot be grasped at all: {', '.join(stuck)}."
        if stuck
        else f"Each of the {len(around.all)} objects in front of the target, beside it or taller can be grasped.",
    )


def _sight(problem: Problem, difficulty: Difficulty) -> Check:
    share = f"{100 * difficulty.visible_fraction:.0f} % of the target is in sight at first"
    stated = problem.origin.get("visible_fraction")
    if isinstance(stated, int | float) and abs(stated - difficulty.visible_fraction) > _SAME_FRACTION:
        text = f"{share}, but the file says {100 * stated:.0f} %: it was changed since."
        return Check("sight", False, text)
    return Check("sight", True, f"{share} ({difficulty.hiddenness.value}).")
