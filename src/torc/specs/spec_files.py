"""spec.json of a trial: the only module that writes and reads it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from torc.errors import InputError
from torc.specs.conditions import Conditions
from torc.specs.trial import PlannerSpec, TrialSpec

TRIAL_SPEC_FORMAT = "torc-trial-spec/2"
Sources = Mapping[str, str]
"""Fingerprints of the files of user-defined parts: by field of `Conditions`, and "planner"."""


@dataclass(frozen=True)
class RecordedSpec:
    """A trial's spec as written to disk, with the fingerprints of the parts that did not come with torc."""

    spec: TrialSpec
    sources: Sources = field(default_factory=dict)

    @property
    def conditions_text(self) -> str:
        """See `Conditions.text`."""
        return self.spec.conditions.text(self.sources)


def to_plain(spec: TrialSpec, sources: Sources) -> dict[str, Any]:
    """Return plain data for spec.json."""
    return {"format": TRIAL_SPEC_FORMAT, **asdict(spec), "sources": dict(sources)}


def from_plain(data: Any, source: str) -> RecordedSpec:
    """Read a spec from plain data; `source` names it in errors. Raises InputError."""
    if not isinstance(data, Mapping):
        raise InputError(f"{source} holds no spec of a trial. It was not written by torc.")
    found = data.get("format")
    if found != TRIAL_SPEC_FORMAT:
        raise InputError(
            f"{source} is of format {found!r}; this torc reads {TRIAL_SPEC_FORMAT!r}. A newer torc may have written it."
        )
    try:
        entry = _FILE.validate_python(data)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the whole"
        raise InputError(f"{source}: {where}: {first['msg']}. It was not written by torc.") from None
    return RecordedSpec(TrialSpec(entry.problem, entry.planner, entry.seed, entry.conditions), entry.sources)


class _File(BaseModel):
    """spec.json. Its text may be a stranger's, so it is bounded."""

    model_config = ConfigDict(extra="ignore", str_max_length=10_000)

    problem: str
    planner: PlannerSpec
    seed: int = Field(default=0, ge=0)
    conditions: Conditions = Conditions()
    sources: dict[str, str] = {}


_FILE = TypeAdapter(_File)
