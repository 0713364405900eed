"""From names to planners."""

import subprocess
import sys

import pytest

from torc.errors import InputError, UnknownNameError
from torc.stages import TASK_PLANNERS
from torc.task_planning.protocol import TaskPlanner
from torc.task_planning.registry import make_planner, planner_paths


@pytest.mark.parametrize("name", ["random", "dg-select"])
def test_built_in_names_make_planners_of_that_name(name: str) -> None:
    planner = make_planner(name)
    assert isinstance(planner, TaskPlanner)
    assert planner.name == name
    assert name in planner_paths()


def test_a_misspelt_name_is_corrected() -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'dg-select'"):
        make_planner("dg-selct")


def test_third_parties_are_named_by_module_and_class(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    code = "class Mine:\n name = 'mine'\n def __init__(self, k=1): self.k = k\n def decide(self, context, rng): ...\n"
    (tmp_path / "their_planner.py").write_text(code)
    (tmp_path / "their_broken_planner.py").write_text("import no_such_library\n")
    (tmp_path / "their_planless_module.py").write_text("class Odd:\n pass\nnumber = 3\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert make_planner("their_planner:Mine", k=5).k == 5
    for path, text in {
        "their_planner:Yours": "no 'Yours'",
        "their_broken_planner:Mine": "no_such_library",
        "no_such_module:Mine": "No module named 'no_such_module'",
        "their_planless_module:Odd": "decide",
        "their_planless_module:number": "not a class",
        "their_planner:": "module:Class",
    }.items():
        with pytest.raises(InputError, match=text):
            make_planner(path)
    with pytest.raises(InputError, match=r"color.*k=1"):
        make_planner("their_planner:Mine", color="red")


def test_installed_packages_add_names(monkeypatch: pytest.MonkeyPatch) -> None:
    class Point:
        name, value = "theirs", "torc.task_planning.random_choice:RandomPlanner"

    class Impostor:
        name, value = "random", "somewhere:Else"

    monkeypatch.setattr("torc.plugins.entry_points", lambda group: [Point, Impostor])
    assert make_planner("theirs").name == "random"
    assert make_planner("random").name == "random"


def test_built_in_names_import_nothing_until_asked() -> None:
    code = "import sys, torc.task_planning.registry; sys.exit('torc.task_planning.dg_select' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    assert all(path.count(":") == 1 for path in TASK_PLANNERS.built_in.values())
