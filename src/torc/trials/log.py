"""The lines of events.jsonl and result.json: one schema writes and reads them.

A file may come from a stranger or an older version of torc, so every line is checked, and newer entries have a default.
Each line except the results records the event or record of that name. Wall times appear only under keys named
"seconds": without those, logs can be compared.
"""

import hashlib
from collections.abc import Mapping
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    InstanceOf,
    PlainSerializer,
    TypeAdapter,
    create_model,
)

from torc.episode.events import (
    Decided,
    Ended,
    EpisodeResult,
    Event,
    Executed,
    Halted,
    Looked,
    Planned,
    Started,
)
from torc.episode.identity import MaskFaults, mask_faults, true_ids
from torc.records import (
    MAX_OBJECTS,
    TARGET_ID,
    Evidence,
    Exchange,
    FeltOutcome,
    GraspStatus,
    PlanFailure,
    Touch,
)

RESULT_FORMAT = "torc-trial/1"
MAX_PICKS = 1000
_Id = Annotated[int, Field(ge=-1, lt=MAX_OBJECTS)]
_Count = Annotated[int, Field(ge=0)]
_Pick = Annotated[int, Field(ge=0, lt=MAX_PICKS)]
_Place = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
_Text = Annotated[str, Field(max_length=1_000_000)]
_Evidence = Annotated[
    InstanceOf[Evidence],
    BeforeValidator(lambda plain: Evidence.from_plain(plain) if isinstance(plain, Mapping) else plain),
    PlainSerializer(Evidence.to_plain),
]


class Line(BaseModel):
    """One line. Entries that this version does not know are ignored."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    @property
    def plain(self) -> dict[str, Any]:
        """The line as written: JSON-compatible, without what was never set."""
        return self.model_dump(mode="json", exclude_unset=True)


class StartedLine(Line):
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


class SeenObject(Line):
    """One visible object of a look."""

    id: _Id
    pixels: _Count


class Blocking(Line):
    """How many grasps of `object` are blocked `by` another one."""

    object: _Id
    by: _Id
    grasps: _Count


class LookedLine(Line):
    event: Literal["looked"]
    pick: _Pick
    target_visible: bool
    target_id: _Id = TARGET_ID
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


class DecidedLine(Line):
    event: Literal["decided"]
    pick: _Pick
    object_id: int | None
    reason: _Text
    attempts: _Count = 1
    give_up: bool = False
    is_target: bool = False
    exchanges: Annotated[tuple[Exchange, ...], Field(max_length=100)] = ()
    evidence: _Evidence = Evidence()
    seconds: FiniteFloat = 0.0


class PlannedLine(Line):
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


class ExecutedLine(Line):
    """`events.Executed`. Older logs do not say what the robot felt."""

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
        """See `PickOutcome.meant_id`."""
        return self.object_id if self.true_id is None else self.true_id

    @property
    def felt_result(self) -> str:
        """The result as the robot felt it."""
        return self.felt.result if self.felt is not None else self.result


class HaltedLine(Line):
    event: Literal["halted"]
    pick: _Pick
    reason: _Text


class ResultFacts(Line):
    """The outcome of an episode, as the last line and result.json hold it; see `EpisodeResult`."""

    retrieved: bool | None = None
    held_target: bool | None = None
    end: _Text | None = None
    picks: _Count | None = None
    drops: _Count | None = None
    dropped: tuple[Annotated[int, Field(ge=-1)], ...] = ()
    outcomes: tuple[_Text, ...] = ()
    grasps_executed: _Count = 0
    grasps_held: _Count = 0
    grasps_delivered: _Count = 0
    seconds: dict[str, FiniteFloat] = {}


class EndedLine(ResultFacts):
    event: Literal["ended"]


class VlmUse(Line):
    """What the model of a trial used. A sum is None unless every reply reported it; `cost` also without prices."""

    calls: _Count | None = None
    tokens_sent: _Count | None = None
    tokens_written: _Count | None = None
    tokens_thinking: _Count | None = None
    cost: Annotated[FiniteFloat, Field(ge=0)] | None = None
    currency: Annotated[str, Field(max_length=100)] = ""


class TrialResult(ResultFacts):
    """result.json.

    Attributes:
        status: "completed", "errored" (a part broke; `error` says how), "interrupted", or another one of a real robot.
        cause: for an errored trial of a benchmark, what ended it: "raised", or how its process ended.
        vlm: the model that the planner asks, as on the command line.
        participant: the planner saw no more than planners may see.
        bound: how sure an oracle is that its picks are the fewest.
        target_absent: the problem has no target.

    Other entries, e.g. of a real robot, are kept unchanged (`model_extra`).
    """

    model_config = ConfigDict(frozen=True, extra="allow")

    format: _Text = RESULT_FORMAT
    status: _Text
    error: _Text | None = None
    cause: _Text = "raised"
    vlm: _Text | None = None
    participant: bool | None = None
    simulated_vlm: dict[str, Any] = {}
    bound: _Text = ""
    target_absent: bool = False
    vlm_use: VlmUse | None = None
    versions: dict[str, _Text] = {}

    @property
    def completed(self) -> bool:
        """True if the trial counts."""
        return self.status == "completed"

    @property
    def summary(self) -> dict[str, Any]:
        """The entries that a list of trials shows."""
        return self.model_dump(include={"status", "retrieved", "end", "picks", "drops", "error"})


EventLine = Annotated[
    StartedLine | LookedLine | DecidedLine | PlannedLine | ExecutedLine | HaltedLine | EndedLine,
    Field(discriminator="event"),
]
EVENT_LINE: TypeAdapter[EventLine] = TypeAdapter(EventLine)
"""Checks a line, whoever wrote it."""
_COUNTED = {"event", "pick", "seconds", "attempts", "score", "result", "object_id", "true_id"}
_COUNTED |= {"held_after_lift", "dropped", "detail", "duration_s"}


def _counted(kind: type[Line]) -> Any:
    """Return the kind of line that looks for `_COUNTED` only: no entry has the empty name."""
    unread = {name: (Any, Field(None, validation_alias="")) for name in set(kind.model_fields) - _COUNTED}
    return create_model(f"Counted{kind.__name__}", __base__=kind, **unread)  # type: ignore[call-overload]


_kinds, _by_event = get_args(EventLine)
_CountedLine: Any = Annotated[reduce(or_, map(_counted, get_args(_kinds))), _by_event]
COUNTED_LINE: TypeAdapter[EventLine] = TypeAdapter(_CountedLine)
"""Checks what tables count of a line, in a tenth of the time; everything else in it is None."""


def line_of(event: Event) -> EventLine:
    """Return the line that records an event."""
    match event:
        case Started():
            return StartedLine(event="started", **_set(vars(event), "guard"))
        case Looked():
            return _looked_line(event)
        case Decided():
            facts = _set(vars(event.decision), "is_target", without=("pictures",))
            return DecidedLine(event="decided", pick=event.pick, **facts, seconds=round(event.seconds, 4))
        case Planned():
            return _planned_line(event)
        case Executed():
            facts = _set(vars(event.outcome), "true_id", "target_p")
            return ExecutedLine(event="executed", pick=event.pick, **facts, seconds=round(event.seconds, 3))
        case Halted():
            return HaltedLine(event="halted", pick=event.pick, reason=event.reason)
        case Ended():
            return EndedLine(event="ended", **result_facts(event.result))


def result_facts(result: EpisodeResult) -> dict[str, Any]:
    """Return the fields of `ResultFacts` for an episode."""
    executed = [o for o in result.outcomes if o.result.grasp_tried]
    return {
        "retrieved": result.retrieved,
        "held_target": result.held_target,
        "end": result.end.value,
        "picks": result.picks,
        "drops": len(result.dropped),
        "dropped": result.dropped,
        "outcomes": tuple(o.result.value for o in result.outcomes),
        "grasps_executed": len(executed),
        "grasps_held": sum(o.held_after_lift for o in executed),
        "grasps_delivered": sum(o.delivered for o in executed),
        "seconds": _round(result.seconds),
    }


def without_seconds(value: Any) -> Any:
    """Return a log line without its wall times: what must be identical when a trial is run again."""
    if isinstance(value, Mapping):
        return {k: without_seconds(v) for k, v in value.items() if k != "seconds"}
    if isinstance(value, list | tuple):
        return [without_seconds(v) for v in value]
    return value


def digest(*arrays: np.ndarray) -> str:
    """Return a short fingerprint of arrays, bit for bit; equal if two runs saw and did exactly the same."""
    sha = hashlib.sha256()
    for array in arrays:
        sha.update(np.ascontiguousarray(array).tobytes())
    return sha.hexdigest()[:16]


def _looked_line(event: Looked) -> LookedLine:
    look, context = event.look, event.look.context
    scene, grasps, report = context.scene, context.grasps, context.report
    truth, faults = true_ids(look), mask_faults(look)
    simulated: dict[str, Any] = {"true_ids": {str(k): true for k, true in truth.items()}} if truth else {}
    if faults is not None:
        simulated["mask_faults"] = faults
    return LookedLine(
        event="looked",
        pick=event.pick,
        target_visible=scene.target_id is not None,
        target_id=scene.target_number,
        objects=tuple(SeenObject(id=o.id, pixels=o.pixel_count) for o in scene.objects),
        unknown_voxels=int(np.count_nonzero(~context.volume.seen)),
        graspable=report.graspable_ids,
        grasps={s.name.lower(): int(np.count_nonzero(report.status == s)) for s in GraspStatus},
        valid_grasps=dict(zip(map(str, report.object_ids), report.valid_total.tolist())),
        blocking=tuple(
            Blocking(object=a, by=b, grasps=int(report.blocking[i, j]))
            for i, a in enumerate(report.object_ids)
            for j, b in enumerate(report.object_ids)
            if report.blocking[i, j]
        ),
        **simulated,
        digest=digest(
            scene.observation.depth_m, scene.label_image, grasps.Ts_world_tcp, grasps.scores, report.qpos
        ),
        seconds=_round(look.seconds),
    )


def _planned_line(event: Planned) -> PlannedLine:
    plan, seconds = event.plan, round(event.seconds, 4)
    if isinstance(plan, PlanFailure):
        return PlannedLine(event="planned", pick=event.pick, failure=plan, seconds=seconds)
    grasps, g = event.look.context.grasps, plan.grasp_index
    motions = {name: getattr(plan, name) for name in ("free", "approach", "lift", "transfer", "home")}
    return PlannedLine(
        event="planned",
        pick=event.pick,
        object_id=plan.object_id,
        score=float(grasps.scores[g]),
        generator=grasps.generator_names[int(grasps.generators[g])],
        T_world_tcp=plan.T_world_tcp.tolist(),
        width_m=float(plan.width_m),
        grasps_tried=plan.grasps_tried,
        durations_s={name: motion.duration_s for name, motion in motions.items()},
        digest=digest(*(motion.qpos for motion in motions.values())),
        seconds=seconds,
        **_set({"ways": dict(event.ways)}, "ways"),
    )


def _set(facts: Mapping[str, Any], *optional: str, without: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return facts for a line; `optional` ones only if they are set, where 0 counts as set."""
    silent = [k for k in optional if facts[k] is None or facts[k] is False or facts[k] in ("", {})]
    return {k: v for k, v in facts.items() if k not in silent and k not in without}


def _round(seconds: Mapping[str, float]) -> dict[str, float]:
    return {name: round(value, 4) for name, value in seconds.items()}
