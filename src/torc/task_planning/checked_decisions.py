"""Ask any task planner, and check that its answer is a valid decision."""

import json
import operator
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np

from torc.errors import PlannerError
from torc.io.record_files import to_plain
from torc.records import (
    BeliefEvidence,
    Certainty,
    Corrections,
    Decision,
    DependencyGraph,
    Evidence,
    Exchange,
    ModelEvidence,
    PlanningContext,
)
from torc.registry.kinds import TASK_PLANNERS
from torc.registry.loading import blamed
from torc.registry.loading import kind_of_value as _kind
from torc.task_planning.protocol import TaskPlanner


def _is_whole(value: Any) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _is_flag(value: Any) -> bool:
    return isinstance(value, bool | np.bool_)


def _holds(kind: type) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, tuple | list) and all(isinstance(v, kind) for v in value)


_FIELDS: Mapping[str, tuple[Callable[[Any], bool], str]] = {
    "object_id": (lambda value: value is None or _is_whole(value), "an int or None"),
    "reason": (lambda value: isinstance(value, str), "text"),
    "give_up": (_is_flag, "True or False"),
    "is_target": (_is_flag, "True or False"),
    "attempts": (_is_whole, "an int"),
    "exchanges": (_holds(Exchange), "a tuple of torc.records.Exchange"),
    "evidence": (
        lambda value: isinstance(value, Evidence),
        "a torc.records.Evidence, which takes facts of your own as Evidence(notes={...})",
    ),
    "pictures": (_holds(bytes), "a tuple of PNG files as bytes"),
}
"""Per field of a decision what it must be, as a test and in words."""
_EVIDENCE: Mapping[str, type] = {
    "graph": DependencyGraph,
    "certainty": Certainty,
    "belief": BeliefEvidence,
    "vlm": ModelEvidence,
    "corrections": Corrections,
}
_HELP = "torc.testing.planner_conformance checks a planner against all rules (docs/task_planners.md)."


def ask_planner(planner: TaskPlanner, context: PlanningContext, rng: np.random.Generator) -> Decision:
    """Return the planner's decision, with plain numbers in place of NumPy's.

    Whether the object can be picked is not judged here: a bad choice is a lost pick, not an error.

    Raises:
        PlannerError: the planner crashed, or its answer is not a valid Decision.
        TorcError: the planner raised it.
    """
    with _blamed(planner):
        answer: Any = planner.decide(context, rng)
    faults = list(decision_faults(answer))
    if faults:
        raise PlannerError(f"Task planner '{planner.name}' gave no valid decision: {faults[0]}. {_HELP}")
    return replace(
        answer,
        object_id=None if answer.object_id is None else operator.index(answer.object_id),
        attempts=operator.index(answer.attempts),
        give_up=bool(answer.give_up),
        is_target=bool(answer.is_target),
    )


def rehearse_planner(planner: TaskPlanner, context: PlanningContext) -> None:
    """Run the planner's `warm_up`, if it has one. Raises PlannerError if it crashes."""
    with _blamed(planner):
        TASK_PLANNERS.traits(planner).warm_up(context)


def _blamed(planner: TaskPlanner) -> AbstractContextManager[None]:
    return blamed(f"Task planner '{planner.name}'", PlannerError, _HELP)


def decision_faults(answer: Any) -> Iterator[str]:
    """Yield the reasons why an answer is not a valid decision."""
    if not isinstance(answer, Decision):
        yield f"decide() returned {_kind(answer)}, not a torc.records.Decision"
        return
    for name, (fits, what) in _FIELDS.items():
        value = getattr(answer, name)
        if not fits(value):
            yield f"{name} is {_kind(value)}; it must be {what}"
    if isinstance(answer.evidence, Evidence):
        yield from _evidence_faults(answer.evidence)
    try:
        json.dumps(to_plain(answer))
    except (TypeError, ValueError, RecursionError) as error:
        yield f"its evidence is not plain data that JSON can hold ({error})"


def _evidence_faults(evidence: Evidence) -> Iterator[str]:
    for name, kind in _EVIDENCE.items():
        value = getattr(evidence, name)
        if value is not None and not isinstance(value, kind):
            yield f"evidence.{name} is {_kind(value)}, not a torc.records.{kind.__name__}"
    p = evidence.probabilities
    if not (isinstance(p, Mapping) and all(_is_whole(k) and isinstance(v, Real) for k, v in p.items())):
        yield "evidence.probabilities must map object ids to numbers"
