"""spec.json of a trial: written and read here alone.

Files of torc 0.1 ("torc-trial/1" beside them in result.json) had one flat object without a format; they are read, too.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from torc.errors import InputError
from torc.specs.conditions import Conditions
from torc.specs.trial import PlannerSpec, TrialSpec
from torc.vlm.config import VlmConfig

TRIAL_SPEC_FORMAT = "torc-trial-spec/2"
Sources = Mapping[str, str]
"""Fingerprints of the files of a user's own parts: by field of `Conditions`, and "planner"."""


@dataclass(frozen=True)
class RecordedSpec:
    """A trial's spec as it was written down, with the fingerprints of the parts that did not come with torc."""

    spec: TrialSpec
    sources: Sources = field(default_factory=dict)

    @property
    def conditions_text(self) -> str:
        """See `Conditions.text`."""
        return self.spec.conditions.text(self.sources)


def to_plain(spec: TrialSpec, sources: Sources) -> dict[str, Any]:
    """Plain data for spec.json."""
    return {"format": TRIAL_SPEC_FORMAT, **asdict(spec), "sources": dict(sources)}


def from_plain(data: Any, source: str) -> RecordedSpec:
    """A spec from plain data of this format or the older one; `source` names it in errors. Raises InputError."""
    if not isinstance(data, Mapping):
        raise InputError(f"{source} holds no spec of a trial. It was not written by torc.")
    found = data.get("format")
    if found is None:
        data = _from_flat(data)
    elif found != TRIAL_SPEC_FORMAT:
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


def _from_flat(data: Mapping[str, Any]) -> dict[str, Any]:
    """The older format: everything in one object, the sources as ROBOT_source."""
    around = {f.name for f in fields(Conditions)}
    planner = {k: data[k] for k in ("vlm", "expert", "outside_view") if data.get(k)}
    if data.get("planner") == "human" and "outside_view" not in data:
        planner["outside_view"] = True  # the page always showed the outside then
    if isinstance(planner.get("vlm"), Mapping):
        planner["vlm"] = {k: v for k, v in planner["vlm"].items() if k in {f.name for f in fields(VlmConfig)}}
    return {
        "problem": data.get("problem"),
        "planner": {"name": data.get("planner"), **planner},
        "seed": data.get("seed", 0),
        "conditions": {k: v for k, v in data.items() if k in around},
        "sources": {k.removesuffix("_source"): v for k, v in data.items() if k.endswith("_source") and v},
    }
