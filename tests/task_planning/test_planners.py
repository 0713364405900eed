"""The planners' choices, and the conformance suite on good and bad planners."""

import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from torc.records import Decision, PlanningContext
from torc.records.graph import DependencyEdge, DependencyGraph, EdgeKind
from torc.task_planning.dg_select import DgSelectPlanner, decide_by_graph, graph_probabilities
from torc.task_planning.graph_building import build_dependency_graph
from torc.task_planning.random_choice import RandomPlanner
from torc.testing import contexts
from torc.testing.conformance import NonConformanceError
from torc.testing.contexts import box, make_context
from torc.testing.planner_conformance import CASES, check_case, check_planner

APART = tuple(box(k, 0.55 + 0.08 * (k % 2), -0.3 + 0.11 * k, (0.04, 0.04, 0.06)) for k in range(5))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
@pytest.mark.parametrize("planner", [RandomPlanner, DgSelectPlanner])
def test_own_planners_conform(planner: type, case) -> None:
    check_case(planner, case)


def choice(context: PlanningContext, relations: list[DependencyEdge]) -> Decision:
    return decide_by_graph(build_dependency_graph(context, relations=relations), context)


def below(a: int, b: int) -> DependencyEdge:
    return DependencyEdge(a, b, EdgeKind.BELOW)


ONE_BEFORE_TWO = {0: [(1,), (1,), (2,)]}
BOTH_ALIKE = {0: [(1,), (2,)]}


@pytest.mark.parametrize(
    ("valid", "blocked", "relations", "chosen", "rule"),
    [
        ({0: 1, 1: 9}, {}, [], 0, "target"),
        ({0: 5, 3: 1}, {}, [below(0, 3)], 3, "most probable sink"),
        ({1: 1, 2: 9}, ONE_BEFORE_TWO, [], 1, "most probable sink"),
        ({2: 1, 4: 9}, ONE_BEFORE_TWO, [], 2, "most probable sink"),
        # Ties go to the object with more grasps, whatever its id.
        ({1: 1, 2: 3}, BOTH_ALIKE, [], 2, "most probable sink"),
        ({1: 3, 2: 1}, BOTH_ALIKE, [], 1, "most probable sink"),
        # 2 has most grasps, but something lies on it.
        ({2: 5, 3: 4, 4: 1}, {0: [(1,)]}, [below(2, 4)], 3, "any graspable"),
        ({}, {0: [(1,)]}, [], None, "nothing graspable"),
    ],
)
def test_the_choice_goes_by_target_then_probability_then_grasps(valid, blocked, relations, chosen, rule):
    decision = choice(make_context(APART, valid=valid, blocked=blocked), relations)
    assert (decision.object_id, decision.evidence.rule) == (chosen, rule)
    assert not decision.give_up


def test_hidden_target_sends_to_the_largest_shadow() -> None:
    assert DgSelectPlanner().decide(contexts.hidden_context(), np.random.default_rng(0)).object_id == 1


def test_reason_follows_the_way_from_the_target() -> None:
    blocked = {0: [(1,), (1,)], 1: [(2,)]}
    decision = choice(make_context(APART, valid={2: 1}, blocked=blocked), [])
    assert decision.reason == (
        "Pick 2 (p = 1.00): it blocks 1 of 1 blocked grasps of 1, which blocks 2 of 2 blocked grasps of the target 0."
    )


@pytest.mark.parametrize("seed", range(6))
def test_choice_does_not_depend_on_how_objects_are_numbered(seed: int) -> None:
    """Probabilities belong to objects, not to ids."""
    context = contexts.cluttered_context(10, seed)
    shapes_probabilities = graph_probabilities(build_dependency_graph(context))
    assert sum(shapes_probabilities.lower) + shapes_probabilities.lost == pytest.approx(1.0)
    decision = DgSelectPlanner().decide(context, np.random.default_rng(0))
    if decision.evidence.rule == "most probable sink":
        rivals = [
            shapes_probabilities[k] for k in shapes_probabilities.sinks if k in context.report.graspable_ids
        ]
        assert shapes_probabilities[decision.object_id] == pytest.approx(max(rivals))


def test_evidence_is_what_the_choice_rests_on() -> None:
    context = contexts.cluttered_context(12, 1, hidden_target=True)
    evidence = json.loads(
        json.dumps(DgSelectPlanner().decide(context, np.random.default_rng(0)).evidence.to_plain())
    )
    graph = DependencyGraph.from_dict(evidence["graph"])
    p = graph_probabilities(graph)
    assert {int(k): v for k, v in evidence["probabilities"].items()} == dict(zip(p.sinks, p.lower))
    assert evidence["certainty"]["exact"]
    assert evidence["certainty"]["lost"] == pytest.approx(p.lost)


def test_random_takes_the_target_first_and_else_all_alike() -> None:
    planner, rng = RandomPlanner(), np.random.default_rng(0)
    assert planner.decide(make_context(APART, valid={0: 1, 1: 1}), rng).object_id == 0
    context = make_context(APART, valid={1: 9, 2: 1, 4: 2})
    drawn = Counter(planner.decide(context, rng).object_id for _ in range(600))
    assert set(drawn) == {1, 2, 4}
    assert all(150 < n < 250 for n in drawn.values())


class _Bad:
    """Breaks one rule, chosen by name."""

    name = "bad"

    def __init__(self, fault: str) -> None:
        self.fault = fault

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        good = RandomPlanner().decide(context, rng)
        if self.fault == "numpy integer" and good.object_id is not None:
            return replace(good, object_id=np.int64(good.object_id))
        if self.fault == "mutates":
            context.grasps.scores[:] = 0
        if self.fault == "global generator":
            np.random.random()
        if self.fault == "nondeterministic":
            return replace(good, reason=f"{np.random.default_rng().random()}")
        changes = {
            "names the blocked": {"object_id": context.scene.ids[0] if context.scene.ids else None},
            "many attempts": {"attempts": 4},
            "no reason": {"reason": " "},
            "evidence": {"evidence": {"x": np.zeros(2)}},
            "not a number": {"evidence": {"x": float("nan")}},
            "gives up with a choice": {"give_up": True},
        }
        return replace(good, **changes.get(self.fault, {}))


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        ("names the blocked", "valid grasp"),
        ("numpy integer", "int64"),
        ("mutates", "changed the context"),
        ("global generator", "global random"),
        ("nondeterministic", "two decisions"),
        ("many attempts", "attempts"),
        ("no reason", "reason"),
        ("evidence", "evidence"),
        ("not a number", "evidence"),
        ("gives up with a choice", "gave up"),
    ],
)
def test_conformance_notices(fault: str, text: str) -> None:
    with pytest.raises(NonConformanceError, match=text):
        check_planner(lambda: _Bad(fault))


def test_conformance_notices_exceptions_and_missing_names() -> None:
    class Raises:
        name = "raises"

        def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
            raise KeyError("oops")

    class Nameless:
        def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
            return Decision(None, "none")

    with pytest.raises(NonConformanceError, match="KeyError"):
        check_planner(Raises)
    with pytest.raises(NonConformanceError, match="name"):
        check_planner(Nameless)
