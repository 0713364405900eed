"""Check what every task planner must do: `check_case(MyPlanner, case)` for each of CASES, or all at once with
`check_planner(MyPlanner)`. Both raise NonConformanceError, which lists what was broken.
"""

import json
from collections.abc import Callable

import numpy as np

from torc.records import Decision, PlanningContext
from torc.registry.kinds import TASK_PLANNERS
from torc.task_planning.protocol import MAX_ATTEMPTS, TaskPlanner, decision_faults
from torc.testing import contexts
from torc.testing.conformance import Case, called_twice, require, trait_faults

CASES: tuple[Case, ...] = (
    Case("target in the open", contexts.open_context),
    Case("target behind another object", contexts.behind_context),
    Case("object on the target", contexts.stacked_context),
    Case("target hidden", contexts.hidden_context),
    Case("single object", contexts.single_context),
    Case("nothing graspable", contexts.nothing_graspable_context),
    Case("nothing in sight", contexts.empty_context),
    Case("clutter", lambda: contexts.cluttered_context(10, seed=5)),
    Case("clutter, target hidden", lambda: contexts.cluttered_context(10, seed=6, hidden_target=True)),
)


def check_planner(
    make: Callable[[], TaskPlanner], cases: tuple[Case, ...] = CASES, seeds: tuple[int, ...] = (0, 1)
) -> None:
    """Run all cases with fresh planners. Raises NonConformanceError with everything that was broken."""
    require(
        "planner",
        [f"{c.name}: {text}" for c in cases for seed in seeds for text in _violations(make, c, seed)],
    )


def check_case(make: Callable[[], TaskPlanner], case: Case, seed: int = 0) -> None:
    """Run one case. Raises NonConformanceError with everything that was broken."""
    check_planner(make, (case,), (seed,))


def _violations(make: Callable[[], TaskPlanner], case: Case, seed: int) -> list[str]:
    if faults := trait_faults(TASK_PLANNERS, make()):
        return faults
    context: PlanningContext = case.build()
    decisions, found = called_twice(
        lambda: make().decide(context, np.random.default_rng(seed)), context, "the context"
    )
    if decisions:
        found += _decision_faults(decisions[0], context)
    if not found and _essence(decisions[0]) != _essence(decisions[1]):
        found.append(f"the same rng gave two decisions: {_essence(decisions[0])}, {_essence(decisions[1])}")
    return found


def _decision_faults(decision: Decision, context: PlanningContext) -> list[str]:
    if found := list(decision_faults(decision)):
        return found
    offered, chosen = context.graspable_ids, decision.object_id
    if chosen is not None and not isinstance(chosen, int):
        found.append(f"object_id is a {type(chosen).__name__}; it must be an int or None")
    elif chosen is not None and chosen not in offered:
        found.append(
            f"it named {chosen}, but the visible objects with a valid grasp are {offered}; else name None"
        )
    if not 1 <= decision.attempts <= MAX_ATTEMPTS:
        found.append(f"attempts is {decision.attempts!r}; it must be 1..{MAX_ATTEMPTS}")
    if not decision.reason.strip():
        found.append("it gave no reason; say in a sentence why")
    if decision.give_up and chosen is not None:
        found.append("it named an object and gave up at once")
    try:
        json.dumps(decision.evidence.to_plain(), allow_nan=False)
    except ValueError:
        found.append("its evidence holds a number that is not finite, which JSON cannot hold")
    return found


def _essence(decision: Decision) -> tuple[int | None, int, bool, str]:
    return decision.object_id, decision.attempts, decision.give_up, decision.reason
