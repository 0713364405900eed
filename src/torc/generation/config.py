"""What kind of problem is wanted."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, get_args

from torc.errors import InputError, UnknownNameError
from torc.perception.segmentation import PerceptionConfig
from torc.problems.schema import Category
from torc.records import MAX_OBJECTS

GENERATOR_VERSION = 2
"""Raised whenever the same configuration and seed give another problem than before."""
LARGE_PILE_VERSION = 3
"""The same for piles that may get more than MANY objects: they are poured otherwise."""
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


class Family(StrEnum):
    """What kind of hard problem is wanted."""

    USUAL = ""
    """None: the rules of torc40."""
    ABSENT = "absent"
    """The target is not there, and nothing in the first look tells so."""
    ABSENT_TWIN = "absent-twin"
    """The same scene, of the same seed, with the target in it."""
    LOOK_ALIKES = "look-alikes"
    """Copies of the target stand around it, which lack a mark that is seen from one side only."""
    UNGRASPABLE = "ungraspable"
    """Something that hides the target or stands before it cannot be grasped at all: the order has to go round it."""
    LARGE = "large"
    """Piles of many objects, under which the target lies."""
    FRAGILE = "fragile"
    """Towers and leaning things: what hides the target or stands before it holds up others, which fall without it."""
    CUPBOARD = "cupboard"
    """Things sorted by kind: the target is hidden behind others of its sort."""


@dataclass(frozen=True)
class FamilyRules:
    """What a family asks of a scene.

    Attributes:
        category: of its scenes, if there is but one.
        hidden: of the target, if not as the configuration says.
        unseen: not a single pixel of the target may be in sight.
        lying: chance that a box of a structured scene lies on its back, however wide it then is; None as usual.
        stuck: how many of the objects that hide the target or are before it cannot be grasped at all, at least; None:
            each object around it must be graspable (the paper's rule).
        copies: how many copies of the target there are, without the mark that it has.
        covered: how many objects hide at least COVERS of the target each, at least.
        stacked: chance that a thing of a structured scene stands on another one, where it fits; None as usual.
        leaning: chance that a high thing leans.
        held_up: how many of the objects that hide the target or are before it hold up others, at least.
        sorted: whether things of one sort stand together, the target behind some of its own.
    """

    category: Category | None = None
    hidden: Hiddenness | None = None
    unseen: bool = False
    lying: float | None = None
    stuck: int | None = None
    covered: int = 0
    copies: int = 0
    stacked: float | None = None
    leaning: float = 0.0
    held_up: int = 0
    sorted: bool = False


RULES = {
    Family.USUAL: FamilyRules(),
    Family.ABSENT: FamilyRules(hidden=Hiddenness.HIDDEN, unseen=True),
    Family.ABSENT_TWIN: FamilyRules(hidden=Hiddenness.HIDDEN, unseen=True),
    Family.LOOK_ALIKES: FamilyRules(copies=3),
    Family.UNGRASPABLE: FamilyRules(lying=0.6, stuck=1),
    Family.LARGE: FamilyRules("unstructured", hidden=Hiddenness.HIDDEN, covered=4),
    Family.FRAGILE: FamilyRules("structured", stacked=0.8, leaning=0.5, held_up=1),
    Family.CUPBOARD: FamilyRules("structured", hidden=Hiddenness.HIDDEN, unseen=True, sorted=True),
}


WantedHiddenness = Literal["any", "visible", "partly", "hidden"]


@dataclass(frozen=True)
class GenerationConfig:
    """What to generate.

    Attributes:
        category: structured (standing, tightly packed) or unstructured (a dumped pile).
        objects: smallest and largest number of objects.
        hidden: how much of the target may be seen at first; "any" takes a visible one only where there is no other.
        held_out: only object kinds held out from training the grasp score, only others, or all (None).
        kinds, models: only objects of these kinds, and of these models; all that come with torc if empty.
        own: also objects that the user has imported; `models` may name such ones anyway.
        attempts: scenes tried until one holds a problem; all from the same seed.
        first_looks: how many times the robot plans grasps from its first look, each time with other random
            candidates; a target that is graspable in any of them is no problem.
        family: which family of harder problems, see `Family`; its rules come before `hidden`.
    """

    category: Category = "structured"
    objects: tuple[int, int] = (8, 20)
    hidden: WantedHiddenness = "any"
    held_out: bool | None = None
    kinds: tuple[str, ...] = ()
    models: tuple[str, ...] = ()
    own: bool = False
    attempts: int = 60
    first_looks: int = 2
    family: Family = Family.USUAL

    def __post_init__(self) -> None:
        low, high = self.objects
        if not 2 <= low <= high <= MAX_OBJECTS:
            raise InputError(f"A problem has 2 to {MAX_OBJECTS} objects, the fewest first, not {low}-{high}.")
        for name, value, valid in (
            ("category", self.category, get_args(Category)),
            ("hiddenness", self.hidden, get_args(WantedHiddenness)),
        ):
            if value not in valid:
                raise UnknownNameError(name, value, list(valid))
        only = RULES[self.family].category
        if only not in (None, self.category):
            kind = "piles" if only == "unstructured" else "of standing objects"
            raise InputError(
                f"Problems of the family {self.family} are {kind} ({only}), not {self.category}."
            )
        if self.attempts < 1 or self.first_looks < 1:
            raise InputError("A problem needs at least one attempt and one first look.")


def generator_version(config: GenerationConfig) -> int:
    """Of the generator that makes problems of a configuration."""
    large = config.category == "unstructured" and config.objects[1] > MANY
    return LARGE_PILE_VERSION if large else GENERATOR_VERSION


def hiddenness_of(fraction: float, pixels: int) -> Hiddenness:
    """The group of a target of which that fraction, and that many pixels, are visible."""
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
    NOTHING_STUCK = "everything before such an object can be grasped"
    CANNOT_BE_GRASPED = "such an object, or one around it, cannot be grasped at all"
    TRIVIAL = "each such object can be grasped at once"
    MOVED_LATER = "something moved within 10 s"


class RejectedError(Exception):
    """A scene holds no problem of the wanted kind."""

    def __init__(self, reason: Reason) -> None:
        super().__init__(reason.value)
        self.reason = reason
