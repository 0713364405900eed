"""spec.json of a trial: the only module that writes and reads it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from torc.io.strict_yaml import validated
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
    head = f"{source} holds no trial's spec of the format {TRIAL_SPEC_FORMAT}; perhaps a newer torc wrote it"
    entry = validated(_File, data, head)
    return RecordedSpec(TrialSpec(entry.problem, entry.planner, entry.seed, entry.conditions), entry.sources)


class _File(BaseModel):
    """spec.json. Its text may be a stranger's, so it is bounded."""

    model_config = ConfigDict(extra="ignore", str_max_length=10_000)

    format: Literal["torc-trial-spec/2"]
    problem: str
    planner: PlannerSpec
    seed: int = Field(default=0, ge=0)
    conditions: Conditions = Conditions()
    sources: dict[str, str] = {}
