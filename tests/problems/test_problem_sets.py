"""What a user may name is found; what is not there is said."""

import shutil
from pathlib import Path

import pytest

from torc.errors import InputError, UnknownNameError
from torc.problems.sets import problem_names, problem_sets, select_problems, shipped_path


def test_the_sets_part_the_problems() -> None:
    names = [name for s in problem_sets() for name in problem_names(s)]
    assert "torc40" in problem_sets()
    assert sorted(names) == sorted(problem_names())
    assert len(set(names)) == len(names)
    with pytest.raises(UnknownNameError, match="torc40"):
        problem_names("torc4")


def test_sets_names_files_and_directories_can_be_mixed(tmp_path: Path) -> None:
    first, second, third = problem_names()[:3]
    shutil.copy(shipped_path(first), tmp_path / "mine.yaml")
    mine = str(tmp_path / "mine.yaml")
    assert select_problems(f"{second}, {mine},{tmp_path},{third},{second}") == (second, mine, third)
    assert select_problems("torc40") == problem_names("torc40")


@pytest.mark.parametrize("selection", ["", " , ", "torc41", "no/such/place"])
def test_what_is_not_there_is_said(selection: str) -> None:
    with pytest.raises(InputError):
        select_problems(selection)
