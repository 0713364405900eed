"""The dependency graph of a scene: precedence of edges, their weights."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.helpers.fake_trial import play_fake_trial
from torc.errors import InputError
from torc.records import TARGET_ID, KnownObject, PlanningContext
from torc.records.graph import DependencyEdge, DependencyGraph, DependencyNode, EdgeKind
from torc.specs.trial import TrialSpec
from torc.task_planning import graph_building
from torc.task_planning.dg_select import DgSelectPlanner, decide_by_graph
from torc.task_planning.graph_building import _built, build_dependency_graph
from torc.testing import contexts
from torc.testing.contexts import box, make_context

APART = tuple(box(k, 0.55 + 0.08 * (k % 2), -0.3 + 0.11 * k, (0.04, 0.04, 0.06)) for k in range(5))


def edges_of(graph: DependencyGraph) -> dict[tuple[int, int], tuple[str, float]]:
    return {(e.source, e.target): (e.kind.value, pytest.approx(e.weight)) for e in graph.edges}


def below(a: int, b: int) -> DependencyEdge:
    return DependencyEdge(a, b, EdgeKind.BELOW)


def behind(a: int, b: int) -> DependencyEdge:
    return DependencyEdge(a, b, EdgeKind.BEHIND)


def test_below_overrides_everything_and_shares_equally() -> None:
    context = make_context(APART, valid={0: 2}, blocked={1: [(2,)]})
    graph = build_dependency_graph(context, relations=[below(0, 3), below(0, 4), behind(0, 1), below(1, 3)])
    assert edges_of(graph) == {(0, 3): ("below", 0.5), (0, 4): ("below", 0.5), (1, 3): ("below", 1.0)}


def test_a_graspable_object_waits_for_nothing_but_what_lies_on_it() -> None:
    context = make_context(APART, valid={1: 1}, blocked={1: [(2,), (3,)]})
    assert build_dependency_graph(context, relations=[behind(1, 2)]).edges == ()


def test_blocking_is_weighted_by_grasps_and_overrides_behind() -> None:
    context = make_context(APART, blocked={1: [(2,), (2, 3), (2,)]})
    graph = build_dependency_graph(context, relations=[behind(1, 4)])
    assert edges_of(graph) == {(1, 2): ("grasp blocking", 0.75), (1, 3): ("grasp blocking", 0.25)}
    assert dict(graph.edges[0].evidence) == {"blocks": 3, "blocked_grasps": 3}


@pytest.mark.parametrize("unreachable", [{}, {1: 4}], ids=["no grasps", "grasps out of reach"])
def test_behind_is_for_objects_that_nothing_else_holds(unreachable: dict[int, int]) -> None:
    context = make_context(APART, unreachable=unreachable)
    graph = build_dependency_graph(context, relations=[behind(1, 2), behind(1, 3), behind(1, 3)])
    assert edges_of(graph) == {(1, 2): ("behind", 0.5), (1, 3): ("behind", 0.5)}
    assert graph.sinks == (0, 2, 3, 4)


def test_hidden_target_waits_for_those_that_hide_space() -> None:
    context = contexts.hidden_context()
    graph = build_dependency_graph(context, relations=[])
    volumes = {k: context.volume.hidden_volume_m3(k) for k in context.scene.ids}
    assert graph.target == TARGET_ID
    assert graph.node(TARGET_ID).hidden
    assert edges_of(graph) == {(0, k): ("hidden by", v / sum(volumes.values())) for k, v in volumes.items()}


def test_hidden_target_without_hidden_space_waits_for_all_alike() -> None:
    context = contexts.hidden_context()
    empty = replace(context.volume, hidden_by=np.zeros_like(context.volume.hidden_by))
    graph = build_dependency_graph(replace(context, volume=empty), relations=[])
    assert edges_of(graph) == {(0, 1): ("hidden by", 0.5), (0, 2): ("hidden by", 0.5)}


def suspecting(p: dict[int, float]) -> PlanningContext:
    """The target is hidden by 1 and 2, or is one of the objects with these probabilities; 9 is out of sight."""
    context = contexts.hidden_context()
    points, look = np.zeros((0, 3), np.float32), np.zeros(0, np.float32)
    known = tuple(KnownObject(k, points, look, 1.0, target_p=v) for k, v in p.items())
    return replace(context, scene=replace(context.scene, known=known))


def test_a_target_that_is_not_recognised_may_be_in_sight() -> None:
    context = suspecting({1: 0.002, 2: 0.8, 9: 0.5})
    graph = build_dependency_graph(context, relations=[])
    volumes = {k: context.volume.hidden_volume_m3(k) for k in (1, 2)}
    hidden = {k: v / sum(volumes.values()) for k, v in volumes.items()}
    assert edges_of(graph) == {
        (0, 1): ("hidden by", 0.2 * hidden[1]),
        (0, 2): ("may be", 0.8 + 0.2 * hidden[2]),
    }
    assert dict(graph.out_edges(0)[1].evidence)["target_p"] == 0.8
    assert dict(graph.out_edges(0)[1].evidence)["hidden_share"] == pytest.approx(hidden[2])


def test_a_doubtful_suspicion_leaves_the_edge_to_what_is_hidden() -> None:
    graph = build_dependency_graph(suspecting({1: 0.05}), relations=[])
    assert {e.kind for e in graph.out_edges(0)} == {EdgeKind.HIDDEN_BY}
    assert sum(e.weight for e in graph.out_edges(0)) == pytest.approx(1)


def test_what_is_surely_in_sight_is_hidden_nowhere() -> None:
    graph = build_dependency_graph(suspecting({1: 0.9, 2: 0.6}), relations=[])
    assert edges_of(graph) == {(0, 1): ("may be", 0.6), (0, 2): ("may be", 0.4)}


def test_a_suspected_object_that_can_be_picked_is_picked_before_what_hides_space() -> None:
    plain = decide_by_graph(build_dependency_graph(suspecting({}), relations=[]), contexts.hidden_context())
    other = 3 - plain.object_id
    context = suspecting({other: 0.9})
    decision = decide_by_graph(build_dependency_graph(context, relations=[]), context)
    assert decision.object_id == other
    assert "may be the target (p = 0.90)" in decision.reason


def peeping(valid: dict[int, int]) -> PlanningContext:
    """A little of the target 0 is in sight behind 1; 2 stands far away."""
    return make_context(
        (
            box(0, 0.72, -0.1, (0.06, 0.06, 0.20)),
            box(1, 0.60, -0.1, (0.06, 0.08, 0.12)),
            box(2, 0.60, 0.3, (0.05, 0.05, 0.10)),
        ),
        valid=valid,
    )


def test_a_target_in_sight_that_nothing_is_known_to_hold_waits_for_what_hides_the_rest_of_it() -> None:
    context = peeping({1: 2, 2: 4})
    graph = build_dependency_graph(context, relations=[])
    assert edges_of(graph) == {(0, 1): ("hidden by", 1.0)}
    assert not graph.node(0).hidden
    assert (
        decide_by_graph(graph, context).reason
        == "Pick 1 (p = 1.00): it hides 100% of the space around the target 0."
    )


def test_no_other_object_does_nor_a_target_that_waits_for_something_or_can_be_picked() -> None:
    assert build_dependency_graph(peeping({1: 2}), relations=[behind(0, 2)]).sinks == (1, 2)
    assert build_dependency_graph(peeping({0: 1, 1: 2}), relations=[]).edges == ()
    assert build_dependency_graph(peeping({0: 1, 2: 1}), relations=[]).edges == ()


def test_an_object_that_hides_nothing_gets_no_edge() -> None:
    context = contexts.hidden_context()
    only_one = np.where(context.volume.hidden_by & np.uint64(2), np.uint64(2), np.uint64(0))
    graph = build_dependency_graph(
        replace(context, volume=replace(context.volume, hidden_by=only_one)), relations=[]
    )
    assert edges_of(graph) == {(0, 1): ("hidden by", 1.0)}


def test_nothing_in_sight() -> None:
    graph = build_dependency_graph(contexts.empty_context())
    assert graph.ids == (TARGET_ID,)
    assert graph.sinks == (TARGET_ID,)


def test_unknown_objects_in_relations_are_refused() -> None:
    context: PlanningContext = make_context(APART)
    for bad in (behind(1, 9), behind(2, 2)):
        with pytest.raises(InputError, match="visible"):
            build_dependency_graph(context, relations=[bad])


def test_a_visible_object_0_that_is_not_the_target_is_refused() -> None:
    context = make_context(APART)
    with pytest.raises(InputError, match="target"):
        build_dependency_graph(replace(context, scene=replace(context.scene, target_id=None)))


@pytest.mark.parametrize("seed", range(8))
def test_weights_sum_to_one_and_json_brings_the_graph_back(seed: int) -> None:
    context = contexts.cluttered_context(12, seed, hidden_target=bool(seed % 2))
    graph = build_dependency_graph(context)
    sums = graph.weight_matrix().sum(axis=1)
    for node_id, total in zip(graph.ids, sums):
        assert total == pytest.approx(0.0 if node_id in graph.sinks else 1.0)
    assert DependencyGraph.from_dict(json.loads(json.dumps(graph.to_dict()))) == graph


@pytest.mark.parametrize(
    "edges",
    [
        (DependencyEdge(0, 9, EdgeKind.BELOW, 1.0),),
        (DependencyEdge(0, 0, EdgeKind.BELOW, 1.0),),
        (DependencyEdge(0, 1, EdgeKind.BELOW, 0.5),),
        (DependencyEdge(0, 1, EdgeKind.BELOW, 0.5), DependencyEdge(0, 1, EdgeKind.BEHIND, 0.5)),
    ],
)
def test_broken_graphs_are_refused(edges: tuple[DependencyEdge, ...]) -> None:
    with pytest.raises(InputError):
        DependencyGraph((DependencyNode(0), DependencyNode(1)), edges, 0)


@pytest.mark.parametrize(
    "change", [{"version": 99}, {"nodes": 3}, {"edges": [{"source": 0}]}, {"target": 77}]
)
def test_broken_files_are_refused(change: dict) -> None:
    data = build_dependency_graph(contexts.stacked_context()).to_dict()
    with pytest.raises(InputError):
        DependencyGraph.from_dict(data | change)


def test_a_trial_builds_each_graph_once(tmp_path, monkeypatch):
    built = []

    def build(context, relations):
        built.append(context)
        return _built(context, relations)

    monkeypatch.setattr(graph_building, "_built", build)
    play_fake_trial(TrialSpec.of("boxes"), tmp_path / "trial", DgSelectPlanner())
    assert len(built) == 2
