"""The outcome of a pick."""

from dataclasses import dataclass
from enum import StrEnum

from torc.records.camera import TARGET_ID


class PickResult(StrEnum):
    """How an attempt ended. All but the first two are failures that use up a pick."""

    RETRIEVED = "retrieved"
    """The target was held after the lift and delivered to the bin."""
    REMOVED = "removed"
    """Another object was held and delivered to the bin."""
    MISSED = "missed"
    """Nothing was held after the lift."""
    SLIPPED = "slipped"
    """The object was held after the lift but lost before the bin."""
    STOPPED = "stopped"
    """The approach, or a motion with the object, ended early, mostly by unexpected contact; the arm backed off."""
    NOT_REACHED = "not reached"
    """The motion to the pre-grasp ended early: the grasp was not tried."""
    NO_VALID_CHOICE = "no valid choice"
    """The task planner named no object that it was allowed to name, in all its tries."""
    NO_VALID_GRASP = "no valid grasp"
    """Nothing in sight has a valid grasp."""
    NO_PLAN = "no motion plan"
    """No motion was found for any valid grasp of the chosen object."""

    @property
    def grasp_tried(self) -> bool:
        """True if the robot went for the grasp; otherwise the attempt says nothing about it."""
        return self.value in ("retrieved", "removed", "missed", "slipped", "stopped")


@dataclass(frozen=True)
class Touch:
    """Where an unexpected contact ended an approach.

    Attributes:
        qpos: the arm afterwards, radians.
        width_m: the gripper's opening.
        relief_m: how far the arm had backed off by then, against the approach.
    """

    qpos: tuple[float, ...]
    width_m: float
    relief_m: float = 0.0


@dataclass(frozen=True)
class FeltOutcome:
    """The gripper's report of a pick. It feels something between the pads, but not which object it is: the result
    assumes the intended object.
    """

    result: PickResult
    held_after_lift: bool = False
    delivered: bool = False


@dataclass(frozen=True)
class PickOutcome:
    """What the robot did and what happened.

    Scores use this record. Planners are given `as_felt`: a real robot does not know which object came up.

    Attributes:
        result: how the attempt ended.
        object_id: the object that was to be picked; -1 if there was none.
        held_id: the object that was held after the lift: the simulator's truth, or the plan's object on a real robot.
        held_after_lift: something was held after the lift, which is the paper's measure of success.
        delivered: the held object was released over the bin.
        dropped: ids of objects other than the target that fell off the table.
        target_lost: the target fell off the table.
        detail: one sentence for people, e.g. which contact stopped the arm.
        duration_s: time on the robot's clock, seconds.
        at_home: the arm ended where it waits for the next pick; otherwise the next pick starts from where it is.
        touch: where unexpected contact ended the approach; None if it did not.
        true_id: the simulator's id of the object that was to be picked, if perception numbers objects itself; None if
            the ids agree or the truth is unknown.
        as_target: the object was picked as the target.
        target_p: probability, by its look in the hand, that the lifted object was the target; None if nobody looked.
        felt: what the gripper reported, if it is known separately from what happened.
    """

    result: PickResult
    object_id: int
    held_id: int | None = None
    held_after_lift: bool = False
    delivered: bool = False
    dropped: tuple[int, ...] = ()
    target_lost: bool = False
    detail: str = ""
    duration_s: float = 0.0
    at_home: bool = True
    touch: Touch | None = None
    felt: FeltOutcome | None = None
    true_id: int | None = None
    as_target: bool = False
    target_p: float | None = None

    @property
    def meant_id(self) -> int:
        """The object that was to be picked, in the ids of `held_id` and `dropped`."""
        return self.object_id if self.true_id is None else self.true_id

    @property
    def held_target(self) -> bool:
        """True if the target was meant and was held after the lift, by the truth or as far as the robot knows."""
        meant = self.as_target if self.true_id is None else self.true_id == TARGET_ID
        return meant and self.held_after_lift and self.held_id == self.meant_id

    @property
    def wrong_object(self) -> bool:
        """True if the robot took another object for the target and delivered it."""
        mistaken = (
            self.true_id is not None and self.true_id != TARGET_ID and self.result is not PickResult.RETRIEVED
        )
        return mistaken and self.felt is not None and self.felt.result is PickResult.RETRIEVED

    @property
    def as_felt(self) -> "PickOutcome":
        """The outcome as the robot knows it: nothing about what it dropped, touched or carried by mistake."""
        felt = self.felt or FeltOutcome(self.result, self.held_after_lift, self.delivered)
        return PickOutcome(
            felt.result,
            self.object_id,
            self.object_id if felt.held_after_lift else None,
            felt.held_after_lift,
            felt.delivered,
            duration_s=self.duration_s,
            at_home=self.at_home,
            touch=self.touch,
        )
