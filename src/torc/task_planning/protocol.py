"""The protocol of task planners: one method that names the next object to pick; and asking one, whatever it does."""

import json
import operator
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import replace
from numbers import Real
from typing import Any, Protocol, runtime_checkable

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

MAX_ATTEMPTS = 3
"""How often a chooser may be asked per pick before the pick is lost (the authors' rule)."""
_WHOLE, _FLAG, _ROW = int | np.integer, bool | np.bool_, tuple | list
_FIELDS: Mapping[str, tuple[Any, str]] = {
    "object_id": (_WHOLE | None, "an int or None"),
    "reason": (str, "text"),
    "give_up": (_FLAG, "True or False"),
    "is_target": (_FLAG, "True or False"),
    "attempts": (_WHOLE, "an int"),
    "exchanges": (_ROW, "a tuple of torc.records.Exchange"),
    "pictures": (_ROW, "a tuple of PNG files as bytes"),
    "evidence": (
        Evidence,
        "a torc.records.Evidence, which takes facts of your own as Evidence(notes={...})",
    ),
    "evidence.graph": (DependencyGraph | None, "a torc.records.DependencyGraph"),
    "evidence.certainty": (Certainty | None, "a torc.records.Certainty"),
    "evidence.belief": (BeliefEvidence | None, "a torc.records.BeliefEvidence"),
    "evidence.vlm": (ModelEvidence | None, "a torc.records.ModelEvidence"),
    "evidence.corrections": (Corrections | None, "a torc.records.Corrections"),
    "evidence.probabilities": (Mapping, "a mapping of object ids to numbers"),
}
"""What each field of a decision must be: a type, and words for it."""
_ELEMENTS = {"exchanges": Exchange, "pictures": bytes}
_HELP = "torc.testing.planner_conformance checks a planner against all rules (docs/task_planners.md)."


@runtime_checkable
class TaskPlanner(Protocol):
    """Decides which object to pick next.

    `torc.testing.planner_conformance` checks an implementation against these rules:

    - `decide` names a visible object with a valid grasp, or None if it found no such choice;
    - it asks its chooser (a model, a person) at most MAX_ATTEMPTS times, and reports how often in `attempts`;
    - all its randomness comes from `rng`; the context is read only;
    - `evidence.notes` is plain data that `json.dumps` accepts.

    A planner with its own numba kernels may have a second method, `warm_up(context)`: it is called before a trial with
    a made-up context, to run each kernel once, so that compilation never counts as decision time.
    """

    @property
    def name(self) -> str:
        """Name in reports and on the command line."""
        ...

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """Return the next object to pick, and why."""
        ...


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
    for path, (kinds, what) in _FIELDS.items():
        value = operator.attrgetter(path)(answer)
        if not _fits(path, value, kinds):
            yield f"{path} is {_kind(value)}; it must be {what}"
            if path == "evidence":
                return
    try:
        json.dumps(to_plain(answer))
    except (TypeError, ValueError, RecursionError) as error:
        yield f"its evidence is not plain data that JSON can hold ({error})"


def _fits(path: str, value: Any, kinds: Any) -> bool:
    if not isinstance(value, kinds) or (isinstance(value, bool) and kinds is not _FLAG):
        return False
    if path in _ELEMENTS:
        return all(isinstance(v, _ELEMENTS[path]) for v in value)
    if path == "evidence.probabilities":
        return all(_fits("", k, _WHOLE) and isinstance(p, Real) for k, p in value.items())
    return True
