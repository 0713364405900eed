"""The lines of events.jsonl, as they are written and as they are read: what is read may come from a stranger.

Each class but the last two is of the event or record of that name. Wall times stand under keys named "seconds" only:
without those, logs are comparable.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, TypeAdapter

from torc.episode.identity import MaskFaults
from torc.records import MAX_OBJECTS, Exchange, FeltOutcome, PlanFailure, Touch

MAX_PICKS = 1000
_Id = Annotated[int, Field(ge=-1, lt=MAX_OBJECTS)]
_Count = Annotated[int, Field(ge=0)]
_Pick = Annotated[int, Field(ge=0, lt=MAX_PICKS)]
_Place = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
_Text = Annotated[str, Field(max_length=1_000_000)]


class _Line(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore")


class StartedLine(_Line):
    event: Literal["started"]
    problem: _Text
    planner: _Text
    seed: int
    target_description: _Text
    max_picks: _Count
    names: tuple[_Text, ...] = ()
    absent: tuple[_Id, ...] = ()
    vlm: _Text = ""
    guard: _Text = ""


class SeenObject(_Line):
    """One visible object of a look."""

    id: _Id
    pixels: _Count


class Blocking(_Line):
    """How many grasps of `object` are blocked `by` another one."""

    object: _Id
    by: _Id
    grasps: _Count


class LookedLine(_Line):
    event: Literal["looked"]
    pick: _Pick
    target_visible: bool
    objects: Annotated[tuple[SeenObject, ...], Field(max_length=MAX_OBJECTS)]
    unknown_voxels: _Count = 0
    graspable: tuple[_Id, ...]
    grasps: dict[str, _Count] = {}
    valid_grasps: dict[str, _Count] = {}
    blocking: tuple[Blocking, ...] = ()
    digest: _Text = ""
    true_ids: dict[str, _Id] = {}
    mask_faults: MaskFaults = MaskFaults()
    seconds: dict[str, FiniteFloat] = {}


class DecidedLine(_Line):
    event: Literal["decided"]
    pick: _Pick
    object_id: int | None
    reason: _Text
    attempts: _Count = 1
    give_up: bool = False
    is_target: bool = False
    exchanges: Annotated[tuple[Exchange, ...], Field(max_length=100)] = ()
    evidence: dict[str, Any] = {}
    seconds: FiniteFloat = 0.0


class PlannedLine(_Line):
    event: Literal["planned"]
    pick: _Pick
    failure: PlanFailure | None = None
    object_id: _Id | None = None
    generator: _Text = ""
    T_world_tcp: tuple[tuple[FiniteFloat, ...], ...] = ()
    digest: _Text = ""
    score: FiniteFloat | None = None
    width_m: FiniteFloat | None = None
    grasps_tried: _Count | None = None
    durations_s: dict[str, FiniteFloat] = {}
    ways: dict[_Text, Annotated[tuple[_Place, ...], Field(max_length=1000)]] = {}
    seconds: FiniteFloat = 0.0


class ExecutedLine(_Line):
    """`events.Executed`. Logs of older trials do not tell what the robot felt."""

    event: Literal["executed"]
    pick: _Pick
    result: _Text
    object_id: _Id
    held_id: _Id | None = None
    held_after_lift: bool = False
    delivered: bool = False
    dropped: tuple[_Id, ...] = ()
    target_lost: bool = False
    detail: _Text = ""
    duration_s: FiniteFloat = 0.0
    at_home: bool = True
    touch: Touch | None = None
    felt: FeltOutcome | None = None
    true_id: _Id | None = None
    target_p: FiniteFloat | None = None
    seconds: FiniteFloat = 0.0

    @property
    def meant_id(self) -> int:
        """As `PickOutcome.meant_id`."""
        return self.object_id if self.true_id is None else self.true_id

    @property
    def felt_result(self) -> str:
        """What the robot took it for."""
        return self.felt.result if self.felt is not None else self.result


class HaltedLine(_Line):
    event: Literal["halted"]
    pick: _Pick
    reason: _Text


class ResultFacts(_Line):
    """`EpisodeResult`: what the last line and result.json tell of it."""

    retrieved: bool | None = None
    held_target: bool | None = None
    end: _Text | None = None
    picks: _Count | None = None
    drops: _Count | None = None
    dropped: tuple[_Id, ...] = ()
    outcomes: tuple[_Text, ...] = ()
    grasps_executed: _Count = 0
    grasps_held: _Count = 0
    grasps_delivered: _Count = 0
    seconds: dict[str, FiniteFloat] = {}


class ResultFile(ResultFacts):
    """result.json: completed, errored or interrupted, and why it errored."""

    status: _Text
    error: _Text | None = None

    @property
    def summary(self) -> dict[str, Any]:
        """What a list of trials shows of it."""
        return self.model_dump(include={"status", "retrieved", "end", "picks", "drops", "error"})


class EndedLine(ResultFacts):
    event: Literal["ended"]


EventLine = Annotated[
    StartedLine | LookedLine | DecidedLine | PlannedLine | ExecutedLine | HaltedLine | EndedLine,
    Field(discriminator="event"),
]
LOG_LINE: TypeAdapter[Any] = TypeAdapter(EventLine)
"""Checks a line, whoever wrote it."""
