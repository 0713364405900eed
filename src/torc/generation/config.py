"""The request for a problem: what to generate."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, get_args

from torc.errors import InputError, UnknownNameError
from torc.perception.segmentation import PerceptionConfig
from torc.problems.schema import Category
from torc.records import MAX_OBJECTS
from torc.registry.kinds import SCENE_FAMILIES
from torc.registry.loading import make_part

GENERATOR_VERSION = 2
"""Raised whenever a configuration and seed give another problem than before."""
LARGE_PILE_VERSION = 3
"""Version of piles that may get more than MANY objects, which are poured in another way."""
MANY = 20
"""Piles of more objects than this are poured in layers, over more room."""


class Hiddenness(StrEnum):
    """How much of the target the robot sees before the first pick."""

    VISIBLE = "visible"
    """At least 75 % of it."""
    PARTLY = "partly"
    """Less than that."""
    HIDDEN = "hidden"
    """Fewer pixels of it than perception asks for to report it."""


VISIBLE_FROM = 0.75
"""Visible fraction from which a target counts as visible."""
WantedHiddenness = Literal["any", "visible", "partly", "hidden"]


@dataclass(frozen=True)
class GenerationConfig:
    """The request for a problem.

    Attributes:
        category: structured (standing, tightly packed) or unstructured (a dumped pile).
        objects: smallest and largest number of objects.
        hidden: how much of the target may be seen at first; "any" takes a visible one only if there is no other.
        held_out: only object kinds held out from training the grasp score, only others, or all (None).
        kinds, models: only objects of these kinds, and of these models; all that come with torc if empty.
        own: also objects that the user has imported; `models` may name those in any case.
        attempts: scenes tried until one holds a problem; all from the same seed.
        family: name of a family of harder problems (`torc/parts/scene_families`), "" for none; its rules come before
            `hidden`.
    """

    category: Category = "structured"
    objects: tuple[int, int] = (8, 20)
    hidden: WantedHiddenness = "any"
    held_out: bool | None = None
    kinds: tuple[str, ...] = ()
    models: tuple[str, ...] = ()
    own: bool = False
    attempts: int = 60
    family: str = ""

    def __post_init__(self) -> None:
        low, high = self.objects
        if not 2 <= low <= high <= MAX_OBJECTS:
            raise InputError(f"A problem has 2 to {MAX_OBJECTS} objects, the fewest first, not {low}-{high}.")
        for what, value, kind in (
            ("kind of problem", self.category, Category),
            ("hiddenness", self.hidden, WantedHiddenness),
        ):
            if value not in get_args(kind):
                raise UnknownNameError(what, value, list(get_args(kind)))
        only = make_part(SCENE_FAMILIES, self.family or "usual").category
        if only not in (None, self.category):
            what = "piles" if only == "unstructured" else "of standing objects"
            raise InputError(
                f"Problems of the family {self.family} are {what} ({only}), not {self.category}."
            )
        if self.attempts < 1:
            raise InputError("A problem needs at least one attempt.")


def hiddenness_of(fraction: float, pixels: int) -> Hiddenness:
    if pixels < PerceptionConfig().min_target_pixels:
        return Hiddenness.HIDDEN
    return Hiddenness.VISIBLE if fraction >= VISIBLE_FROM else Hiddenness.PARTLY


class Reason(StrEnum):
    """The step at which an attempt ended, in the order of the steps."""

    DOES_NOT_FIT = "the objects do not fit side by side"
    PHYSICS = "the simulation broke"
    TOO_FEW_LEFT = "too few objects stayed within reach"
    NOT_AT_REST = "it did not come to rest"
    WEDGED = "objects are pressed into each other"
    NONE_SO_HIDDEN = "no object is hidden as wanted"
    NO_COPY_IN_SIGHT = "no copy of the target is in sight"
    NOT_COVERED = "no such object is covered by enough others"
    NOT_AMONG_ITS_SORT = "no such object is behind things of its sort"
    NOTHING_HELD_UP = "too few things before such an object hold up others"
    UNFIT = "no such object fits the family"
    NOTHING_STUCK = "everything before such an object can be grasped"
    CANNOT_BE_GRASPED = "such an object, or one around it, cannot be grasped at all"
    TRIVIAL = "each such object can be grasped at once"
    MOVED_LATER = "something moved within 10 s"


class RejectedError(Exception):
    """A scene holds no problem of the wanted kind."""

    def __init__(self, reason: Reason) -> None:
        super().__init__(reason.value)
        self.reason = reason
