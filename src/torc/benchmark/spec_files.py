"""spec.json of a benchmark's store: written and read here alone.

Stores of torc 0.1 (`torc-bench/1`) are read, too: reports and the viewer show them. `torc bench` begins them anew.
"""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from pydantic import TypeAdapter, ValidationError

from torc.benchmark.spec import Around, BenchPlanner, BenchProblem, BenchSpec, PlannedTrial
from torc.errors import InputError
from torc.specs.files import from_plain

SPEC_FORMAT = "torc-bench/2"
_FIRST_FORMAT = "torc-bench/1"


def to_json(spec: BenchSpec) -> dict[str, Any]:
    """Plain data; `from_json` gives back an equal spec."""
    # Trials of the same label may differ in source or version: each combination is written once.
    parts: dict[str, list[dict[str, Any]]] = {"problems": [], "planners": []}
    trials = [
        {
            "id": trial.id,
            "problem": _index(parts["problems"], asdict(trial.problem)),
            "planner": _index(parts["planners"], asdict(trial.planner)),
            "seed": trial.seed,
            "torc": trial.version,
            "directory": trial.directory_name,
        }
        for trial in spec.trials
    ]
    around = {"conditions": asdict(spec.around.conditions), "sources": dict(spec.around.sources)}
    return {"format": SPEC_FORMAT, **around, **parts, "trials": trials}


def from_json(data: Mapping[str, Any], source: str) -> BenchSpec:
    """A spec from plain data; `source` names it in errors. Raises InputError."""
    found = data.get("format") if isinstance(data, Mapping) else None
    if found not in (SPEC_FORMAT, _FIRST_FORMAT):
        raise InputError(
            f"{source} is of format {found!r}; this torc reads {SPEC_FORMAT!r}. A newer torc may have written it."
        )
    try:
        data = _from_first(data, source) if found == _FIRST_FORMAT else data
        around = _AROUND.validate_python({k: data[k] for k in ("conditions", "sources")})
        problems = [BenchProblem(**p) for p in data["problems"]]
        planners = [_PLANNER.validate_python(p) for p in data["planners"]]
        trials = []
        for t in data["trials"]:
            problem, planner = problems[t["problem"]], planners[t["planner"]]
            facts = int(t["seed"]), around.under(planner), str(t["torc"]), str(t["id"])
            trials.append(PlannedTrial(problem, planner, *facts))
    except (KeyError, TypeError, ValueError, IndexError, ValidationError) as error:
        raise InputError(
            f"{source} is damaged ({type(error).__name__}: {error}). Use another --out."
        ) from None
    return BenchSpec(around, tuple(trials))


_AROUND = TypeAdapter(Around)
_PLANNER = TypeAdapter(BenchPlanner)


def _from_first(data: Mapping[str, Any], source: str) -> dict[str, Any]:
    """The older format: `settings` with the sources in it, planners flat."""
    one = from_plain({"problem": "", "planner": "", **data["settings"]}, source)
    planners = [
        {"spec": {"name": p["name"], "vlm": p["vlm"]}, "source": p["source"]} for p in data["planners"]
    ]
    return {**data, "conditions": one.spec.conditions, "sources": dict(one.sources), "planners": planners}


def _index(entries: list[dict[str, Any]], entry: dict[str, Any]) -> int:
    if entry not in entries:
        entries.append(entry)
    return entries.index(entry)
