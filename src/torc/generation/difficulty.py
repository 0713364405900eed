"""How difficult a problem is, as far as can be told without solving it."""

from dataclasses import dataclass

from torc.generation.config import Hiddenness
from torc.generation.inspection import Inspector, SceneView
from torc.generation.surroundings import Surroundings
from torc.problems.problem import Problem
from torc.problems.schema import Scalar


@dataclass(frozen=True)
class Difficulty:
    """Facts of a problem: the target's visible pixels against those it would have alone, and how many objects are
    around it, see `surroundings`."""

    objects: int
    hiddenness: Hiddenness
    visible_fraction: float
    in_front: int
    beside: int
    taller: int

    def facts(self) -> dict[str, Scalar]:
        """As they are written into a problem file."""
        return {
            "hiddenness": self.hiddenness.value,
            "visible_fraction": round(self.visible_fraction, 4),
            "in_front": self.in_front,
            "beside": self.beside,
            "taller": self.taller,
        }

    def words(self) -> str:
        """One line."""
        seen = f"target {100 * self.visible_fraction:.0f} % in sight ({self.hiddenness.value})"
        around = f"{self.in_front} in front, {self.beside} beside, {self.taller} taller"
        return f"{self.objects} objects, {seen}, {around}"


def measure_difficulty(
    inspector: Inspector, view: SceneView, target: str, around: Surroundings
) -> Difficulty:
    """The facts of a problem with that target."""
    counts = len(around.in_front), len(around.beside), len(around.taller)
    return Difficulty(
        len(view.problem.objects), inspector.hiddenness(view, target), view.fraction(target), *counts
    )


def difficulty_of(problem: Problem, inspector: Inspector) -> Difficulty:
    """The facts of a problem: as its file states them, or measured where it does not."""
    stated = stated_difficulty(problem)
    if stated is not None:
        return stated
    around = inspector.around(problem, problem.target)
    return measure_difficulty(inspector, inspector.view(problem), problem.target, around)


def stated_difficulty(problem: Problem) -> Difficulty | None:
    """What `Difficulty.facts` wrote into the problem's origin; None if that is not there, or of another target."""
    if problem.origin.get("target", problem.target) != problem.target:
        return None
    names = ("hiddenness", "visible_fraction", "in_front", "beside", "taller")
    try:
        group, fraction, *counts = (problem.origin[name] for name in names)
        return Difficulty(len(problem.objects), Hiddenness(str(group)), float(fraction), *map(int, counts))
    except (KeyError, ValueError):
        return None
