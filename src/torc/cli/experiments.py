"""An experiment for `torc bench` as a YAML file."""

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field

from torc.errors import InputError
from torc.io.strict_yaml import read_yaml_as
from torc.specs.conditions import Conditions

_MAX_BYTES = 100_000
_REMEDY = "docs/benchmarking.md shows one."


class _Planner(BaseModel, extra="forbid"):
    name: str
    settings: dict[str, Any] = {}


class _Experiment(BaseModel, extra="forbid"):
    problems: str | list[str] = []
    planners: list[str | _Planner] = []
    repeats: int = Field(default=0, ge=1)
    first_seed: int = Field(default=0, ge=0)
    sweep: dict[str, list[Any]] = {}
    conditions: dict[str, Any] = {}


def read_experiment(path: Path) -> dict[str, Any]:
    """Return a file's content as fields of the command. Raises InputError naming file and field."""
    found = read_yaml_as(_Experiment, path, "experiment", _MAX_BYTES, _REMEDY)
    known = {f.name for f in fields(Conditions)}
    if unknown := sorted(found.conditions.keys() - known):
        raise InputError(f"{path}: conditions.{unknown[0]} is none; there are {', '.join(sorted(known))}.")
    named = [_Planner(name=p) if isinstance(p, str) else p for p in found.planners]
    given = {
        "problems": found.problems if isinstance(found.problems, str) else ",".join(found.problems),
        "own_planners": tuple((p.name, p.settings) for p in named),
        "repeats": found.repeats,
        "first_seed": found.first_seed,
        "sweep": tuple(
            f"{name}={','.join(v if isinstance(v, str) else json.dumps(v) for v in values)}"
            for name, values in found.sweep.items()
        ),
    }
    return {k: v for k, v in given.items() if v} | {"conditions": Conditions(**found.conditions)}
