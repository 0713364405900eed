"""Importing many scenes: what is asked for is made, and whatever is not made has a reason."""

from dataclasses import replace

import pytest

from tests.helpers.graspclutter6d_tree import upright, write_tree
from torc.errors import InputError
from torc.generation.graspclutter6d import making
from torc.generation.graspclutter6d.making import ImportRequest, run_import
from torc.generation.graspclutter6d.placing import ImportConfig
from torc.problems.problem import load_problem
from torc.robots.loading import load_robot
from torc.sim.settling import StillnessConfig

SPREAD = (upright(17, 0.0, 0.0, 0.3), upright(48, 0.10, 0.05), upright(56, -0.10, 0.02, 1.0))
CANS = (upright(44, 0.0, 0.0), upright(44, 0.1, 0.0), upright(44, 0.0, 0.1), upright(17, 0.1, 0.12))
QUICK = ImportConfig(still=StillnessConfig(seconds=0.5))


class _View:
    def fraction(self, name):
        return 0.5


class _Inspector:
    """Everything is half in sight; nothing makes a problem of itself."""

    robot = load_robot()

    def view(self, problem):
        return _View()

    def around(self, problem, target):
        raise AssertionError("only asked for when a target has to be chosen")


@pytest.fixture
def root(tmp_path):
    write_tree(tmp_path / "gc6d", {249: SPREAD, 110: CANS}, images=15)
    return tmp_path / "gc6d"


def _run(root, out, **request):
    return run_import(ImportRequest(root, config=QUICK, **request), _Inspector(), out)


def test_the_papers_problems_of_a_scene_have_its_targets_and_one_layout(root, tmp_path):
    attempts = _run(root, tmp_path / "out", paper=True, scenes=(110,))
    assert [a.target for a in attempts] == ["obj_000044_0", "obj_000044_1", "obj_000044_2"]
    problems = [load_problem(a.file) for a in attempts]
    assert [p.target for p in problems] == [a.target for a in attempts]
    assert {p.category for p in problems} == {"unstructured"}
    assert problems[0].objects == problems[1].objects == problems[2].objects
    assert {p.origin["target_by"] for p in problems} == {"the paper"}
    assert all(a.in_sight == 0.5 for a in attempts)


def test_files_are_replaced_only_on_request(root, tmp_path):
    request = ImportRequest(root, scenes=(249,), target="17", config=QUICK)
    elsewhere = replace(QUICK, placement="paper")
    (first,) = run_import(request, _Inspector(), tmp_path / "out")
    (kept,) = run_import(request, _Inspector(), tmp_path / "out")
    assert (kept.there, kept.file, kept.problem) == (True, first.file, first.problem)
    for other in (replace(request, category="unstructured"), replace(request, config=elsewhere)):
        (refused,) = run_import(other, _Inspector(), tmp_path / "out")
        assert refused.file is None
        assert "imported otherwise; --overwrite" in refused.reason
    (again,) = run_import(request, _Inspector(), tmp_path / "out", overwrite=True)
    assert (again.there, again.file, again.problem) == (False, first.file, first.problem)


def test_a_run_that_was_interrupted_goes_on_where_it_was(root, tmp_path, monkeypatch):
    first = _run(root, tmp_path / "out", paper=True, scenes=(110, 249))
    lost = next(a for a in first if a.scene == 110)
    lost.file.unlink()
    settled = _count_settling(monkeypatch)
    again = _run(root, tmp_path / "out", paper=True, scenes=(110, 249))
    assert settled == [110]
    assert [a.scene for a in again] == [a.scene for a in first]
    assert {a.file for a in again} == {a.file for a in first}
    assert [a.target for a in again if not a.there] == [lost.target]


def _count_settling(monkeypatch):
    settled, settle_scene = [], making.settle_scene
    monkeypatch.setattr(making, "settle_scene", lambda *a: settled.append(a[1].number) or settle_scene(*a))
    return settled


@pytest.mark.parametrize(
    ("request_", "told"),
    [
        ({}, "Say what to import"),
        ({"paper": True, "target": "17"}, "has its own targets"),
        ({"paper": True, "scenes": (250,)}, "no problem in scene 250; its scenes are 198, 223"),
        ({"scenes": (249,), "target": "../x"}, "no object of a scene"),
    ],
)
def test_requests_that_make_no_sense_are_refused_before_any_work(root, tmp_path, request_, told):
    with pytest.raises(InputError, match=told):
        _run(root, tmp_path / "out", **request_)
    assert not (tmp_path / "out").exists()
