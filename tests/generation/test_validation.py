"""Validation finds what is wrong with a problem, and says so in words."""

from dataclasses import replace

import numpy as np

from torc.generation.validation import validate_problem
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
