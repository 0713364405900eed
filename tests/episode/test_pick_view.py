"""What is kept of a pick agrees with what the planner saw."""

from dataclasses import fields, is_dataclass

import numpy as np
import pytest

from torc.episode.pick_view import load_view, view_of
from torc.records.serialization import save_record
from torc.task_planning.graph_building import build_dependency_graph
from torc.testing.contexts import behind_context, cluttered_context, empty_context, hidden_context


def assert_same(a, b):
    if is_dataclass(a):
        for f in fields(a):
            assert_same(getattr(a, f.name), getattr(b, f.name))
    elif isinstance(a, np.ndarray):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
    elif isinstance(a, tuple | list):
        assert len(a) == len(b)
        for x, y in zip(a, b):
            assert_same(x, y)
    else:
        assert a == b


@pytest.mark.parametrize(
    "make", [behind_context, hidden_context, empty_context, lambda: cluttered_context(9, 4)]
)
def test_a_view_is_the_same_again_and_survives_the_disk(make, tmp_path):
    context = make()
    view = view_of(context)
    assert_same(view, view_of(context))
    save_record(view, tmp_path / "view.npz")
    assert_same(load_view(tmp_path / "view.npz"), view)


def test_the_facts_are_those_of_the_report():
    context = cluttered_context(12, 2)
    view, report = view_of(context), context.report
    assert tuple(o.id for o in view.objects) == context.scene.ids
    for o, valid, blocked in zip(view.objects, report.valid_total, report.blocked_total):
        assert o.statuses.get("valid", 0) == valid
        assert o.statuses.get("blocked", 0) == blocked
        assert (o.best_score is None) == (valid == 0)
        assert o.hidden_volume_m3 == pytest.approx(context.volume.hidden_volume_m3(o.id))
        row = report.blocking[report.object_ids.index(o.id)]
        assert {int(k): n for k, n in o.blockers.items()} == {
            k: n for k, n in zip(report.object_ids, row.tolist()) if n
        }
    assert view.graph == build_dependency_graph(context).to_dict()


def test_the_unseen_voxels_are_all_there_with_who_hides_them():
    context = cluttered_context(8, 1)
    unseen, volume = view_of(context).unseen, context.volume
    rebuilt = np.zeros_like(volume.hidden_by)
    seen = np.ones_like(volume.seen)
    place = tuple(unseen.index.astype(int).T)
    rebuilt[place], seen[place] = unseen.hiders[unseen.hider], False
    np.testing.assert_array_equal(seen, volume.seen)
    np.testing.assert_array_equal(rebuilt, volume.hidden_by)
