"""The lines of events.jsonl and the other small files of a trial, checked: they may come from a stranger."""

import json
import re
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, TypeAdapter, ValidationError

from torc.errors import InputError
from torc.records import MAX_OBJECTS, PlanStage
from torc.scenes.strict_files import read_bytes

MAX_LOG_BYTES, MAX_FACTS_BYTES = 64 * 2**20, 2**20
MAX_PICKS = 1000
_Id = Annotated[int, Field(ge=-1, lt=MAX_OBJECTS)]
_Count = Annotated[int, Field(ge=0)]
_Pick = Annotated[int, Field(ge=0, lt=MAX_PICKS)]
_Text = Annotated[str, Field(max_length=1_000_000)]
_HALF_PAIR = re.compile(
    r"\\u[dD][89abAB][0-9a-fA-F]{2}(?!\\u[dD][c-fC-F])|(?<!\\u[dD][89abAB]..)\\u[dD][c-fC-F][0-9a-fA-F]{2}"
)
_Model = TypeVar("_Model", bound=BaseModel)


class _Line(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore")


class StartedLine(_Line):
    """`events.Started`."""

    event: Literal["started"]
    problem: _Text
    planner: _Text
    seed: int
    target_description: _Text
    max_picks: _Count
    names: tuple[_Text, ...] = ()


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
    """`events.Looked`."""

    event: Literal["looked"]
    pick: _Pick
    target_visible: bool
    objects: Annotated[tuple[SeenObject, ...], Field(max_length=MAX_OBJECTS)]
    graspable: tuple[_Id, ...]
    valid_grasps: dict[str, _Count] = {}
    blocking: tuple[Blocking, ...] = ()
    digest: _Text = ""


class ExchangeText(_Line):
    """A prompt and its reply."""

    prompt: _Text
    reply: _Text


class DecidedLine(_Line):
    """`events.Decided`."""

    event: Literal["decided"]
    pick: _Pick
    object_id: int | None
    reason: _Text
    attempts: _Count = 1
    give_up: bool = False
    exchanges: Annotated[tuple[ExchangeText, ...], Field(max_length=100)] = ()
    evidence: dict[str, Any] = {}
    seconds: FiniteFloat = 0.0


class FailureText(_Line):
    """`PlanFailure`."""

    stage: PlanStage
    reason: _Text
    grasps_tried: _Count


class PlannedLine(_Line):
    """`events.Planned`."""

    event: Literal["planned"]
    pick: _Pick
    failure: FailureText | None = None
    score: FiniteFloat | None = None
    width_m: FiniteFloat | None = None
    grasps_tried: _Count | None = None
    durations_s: dict[str, FiniteFloat] = {}
    seconds: FiniteFloat = 0.0


class FeltText(_Line):
    """`FeltOutcome`."""

    result: _Text


class ExecutedLine(_Line):
    """`events.Executed`. Logs of older trials do not tell what the robot felt."""

    event: Literal["executed"]
    pick: _Pick
    result: _Text
    object_id: _Id
    held_id: _Id | None = None
    delivered: bool = False
    dropped: tuple[_Id, ...] = ()
    target_lost: bool = False
    detail: _Text = ""
    duration_s: FiniteFloat = 0.0
    felt: FeltText | None = None

    @property
    def felt_result(self) -> str:
        """What the robot took it for."""
        return self.felt.result if self.felt is not None else self.result


class EndedLine(_Line):
    """`events.Ended`."""

    event: Literal["ended"]


class AskedModel(_Line):
    """The VLM that a planner asks."""

    provider: _Text
    model: _Text = ""


class SpecFacts(_Line):
    """spec.json."""

    problem: _Text
    planner: _Text
    seed: int = 0
    expert: _Text = ""
    vlm: AskedModel | None = None

    @property
    def who(self) -> str:
        """The planner, and the VLM that it asks: "simulated:..." is none."""
        if self.vlm is None:
            return self.planner
        return f"{self.planner} asking {self.vlm.provider}:{self.vlm.model}".rstrip(":")


class ResultFacts(_Line):
    """result.json."""

    status: _Text
    retrieved: bool | None = None
    end: _Text | None = None
    picks: _Count | None = None
    drops: _Count | None = None
    error: _Text | None = None


EventLine = Annotated[
    StartedLine | LookedLine | DecidedLine | PlannedLine | ExecutedLine | EndedLine,
    Field(discriminator="event"),
]
_ADAPTER: TypeAdapter[Any] = TypeAdapter(EventLine)


def read_events(path: Path) -> list[Any]:
    """The lines of a log, as far as it is complete: a trial that is being played may be writing the last one.

    Raises:
        InputError: missing, too large, or a line that is no event; names the line.
    """
    text = read_bytes(path, MAX_LOG_BYTES, "the log of a trial").decode("utf-8", "replace")
    whole, _, _ = text.rpartition("\n")
    events = []
    for number, line in enumerate(whole.split("\n") if whole else [], start=1):
        try:
            events.append(_ADAPTER.validate_python(_parse(line)))
        except (ValueError, RecursionError) as error:
            raise InputError(f"{path}, line {number}: {_said(error)}. This is no log of a trial.") from None
    return events


def read_facts(path: Path, model: type[_Model]) -> _Model:
    """spec.json or result.json. Raises InputError as `read_events`."""
    raw = read_bytes(path, MAX_FACTS_BYTES, "facts of a trial").decode("utf-8", "replace")
    try:
        return model.model_validate(_parse(raw))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: {_said(error)}. It was not written by torc.") from None


def _parse(text: str) -> Any:
    # Half a surrogate pair is no text; NaN and Infinity are no JSON, and no browser takes them.
    return json.loads(_HALF_PAIR.sub(r"\\ufffd", text), parse_constant=lambda _: None)


def _said(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors()[0]
        return f"{'.'.join(map(str, first['loc'])) or 'the whole'}: {first['msg']}"
    return "nested too deeply" if isinstance(error, RecursionError) else str(error)
