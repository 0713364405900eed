"""Validation finds what is wrong with a problem, and says so in words."""

from dataclasses import replace

import numpy as np
import pytest

from torc.generation.validation import validate_problem
from torc.problems.problem import ObjectPlacement, load_problem
from torc.sim.settling import StillnessConfig
from torc.workspace.workspace_files import load_workspace

QUICK = {"stillness": StillnessConfig(seconds=1.0), "first_looks": 1}
GOOD = load_problem("structured-04")
TABLE_Z = load_workspace().support_z_m
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


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


def _inside():
    can = next(o for o in GOOD.objects if o.name == GOOD.target)
    return _with(GOOD, replace(can, name="twin", position=(can.position[0] + 0.01, *can.position[1:])))


def _floating():
    return _with(GOOD, ObjectPlacement("in_the_air", "mug_red", (0.65, 0.15, TABLE_Z + 0.2), UPRIGHT))


def _free():
    free = ObjectPlacement("free", "soup_can_red", (0.55, 0.17, TABLE_Z + 0.0505), UPRIGHT)
    return replace(_with(GOOD, free), target="free")


def _beside_a_wide_box():
    x, y, _ = next(o for o in GOOD.objects if o.name == GOOD.target).position
    at = (x + 0.02, y + 0.19)
    book = ObjectPlacement("big_book", "book_blue", (*at, TABLE_Z + 0.0135), UPRIGHT)
    others = (o for o in GOOD.objects if np.hypot(*np.subtract(o.position[:2], at)) > 0.16)
    return replace(GOOD, objects=(*others, book))


@pytest.mark.parametrize(
    ("problem", "check", "words"),
    [
        (_inside(), "contact", ("twin", "inside each other")),
        (_floating(), "rest", ("in_the_air", "2 mm")),
        (_free(), "first look", ("at once",)),
        (_beside_a_wide_box(), "surroundings", ("big_book",)),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_wrong_is_found_and_told(inspector, problem, check, words):
    report, checks = _checks(problem, inspector)
    assert not report.valid
    assert not checks[check].passed
    assert all(word in checks[check].text for word in words)
