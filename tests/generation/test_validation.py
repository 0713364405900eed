"""Validation finds what is wrong with a problem, and says so in words."""

from dataclasses import replace

import numpy as np
import pytest

from torc.generation.validation import Check, validate_problem
from torc.objects.files import save_object
from torc.objects.library import load_object
from torc.problems.problem import ObjectPlacement, load_problem
from torc.sim.stillness import StillnessConfig
from torc.workspace.files import load_workspace

QUICK = {"stillness": StillnessConfig(seconds=1.0), "first_looks": 1}
GOOD = load_problem("structured-04")
TABLE_Z = load_workspace().support_z_m


def _with(problem, *more):
    return replace(problem, objects=(*problem.objects, *more))


def _checks(problem, inspector, **options):
    report = validate_problem(problem, inspector, **QUICK, **options)
    return report, {check.name: check for check in report.checks}


def test_a_shipped_problem_is_valid_line_by_line(inspector):
    told = []
    report, checks = _checks(GOOD, inspector, progress=told.append)
    assert report.valid
    assert list(checks) == ["contact", "rest", "sight", "first look", "target", "surroundings"]
    assert tuple(told) == report.checks
    assert all(check.text.endswith((".", ").")) for check in report.checks)
    assert report.difficulty.objects == len(GOOD.objects)


def test_objects_inside_each_other(inspector):
    can = next(o for o in GOOD.objects if o.name == GOOD.target)
    twin = replace(can, name="twin", position=(can.position[0] + 0.01, *can.position[1:]))
    report, checks = _checks(_with(GOOD, twin), inspector)
    assert not report.valid
    assert not checks["contact"].passed
    assert "twin" in checks["contact"].text
    assert "inside each other" in checks["contact"].text


def test_an_object_in_the_air_moves(inspector):
    floating = ObjectPlacement("mug_in_the_air", "mug_red", (0.65, 0.15, TABLE_Z + 0.2), (1.0, 0.0, 0.0, 0.0))
    _, checks = _checks(_with(GOOD, floating), inspector)
    assert not checks["rest"].passed
    assert "mug_in_the_air" in checks["rest"].text
    assert "2 mm" in checks["rest"].text


def test_a_target_that_can_be_grasped_at_once_is_no_task(inspector):
    free = ObjectPlacement("free", "soup_can_red", (0.55, 0.17, TABLE_Z + 0.0505), (1.0, 0.0, 0.0, 0.0))
    report, checks = _checks(replace(_with(GOOD, free), target="free"), inspector)
    assert not report.valid
    assert not checks["first look"].passed
    assert "at once" in checks["first look"].text


def test_a_wide_box_that_lies_beside_the_target_makes_it_unsolvable(inspector):
    target = next(o for o in GOOD.objects if o.name == GOOD.target)
    x, y, _ = target.position
    book = ObjectPlacement(
        "big_book", "book_blue", (x + 0.02, y + 0.19, TABLE_Z + 0.0135), (1.0, 0.0, 0.0, 0.0)
    )
    others = tuple(
        o for o in GOOD.objects if np.hypot(o.position[0] - x - 0.02, o.position[1] - y - 0.19) > 0.16
    )
    _, checks = _checks(replace(GOOD, objects=(*others, book)), inspector)
    assert not checks["surroundings"].passed
    assert "big_book" in checks["surroundings"].text


def test_a_changed_visible_fraction_is_noticed(inspector):
    _, checks = _checks(replace(GOOD, origin={"visible_fraction": 0.4}), inspector)
    assert not checks["sight"].passed
    assert "40 %" in checks["sight"].text
    _, checks = _checks(replace(GOOD, origin={"visible_fraction": 0.0}), inspector)
    assert checks["sight"].passed


def _thing_in(problem, model, store):
    """The problem with a stored object on the table."""
    save_object(model, store / model.name)
    x, y, z = 0.55, 0.2, TABLE_Z + model.size_m[2] / 2
    return _with(problem, ObjectPlacement("it", model.name, (x, y, z), (1.0, 0.0, 0.0, 0.0)))


def test_a_damaged_object_fails_its_problem_alone(inspector, object_store):
    problem = _thing_in(GOOD, replace(load_object("die_red"), name="thing"), object_store)
    (object_store / "thing" / "geometry.npz").write_bytes(b"")
    report, checks = _checks(problem, inspector)
    assert not report.valid
    assert report.difficulty is None
    assert list(checks) == ["objects"]
    assert "geometry.npz is not a readable" in checks["objects"].text


@pytest.mark.parametrize("solved", [True, False])
def test_solving_again_is_one_more_check(inspector, solved):
    asked = []

    def resolve(problem):
        asked.append(problem)
        return Check("solved", solved, "In 3 picks.")

    report, checks = _checks(GOOD, inspector, resolve=resolve)
    assert asked == [GOOD]
    assert checks["solved"].text == "In 3 picks."
    assert report.valid == solved
