"""Whatever a planner does, asking it ends in a decision or in an error that says what is wrong."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError, PlannerError, UnknownNameError
from torc.io.record_files import to_plain
from torc.pipeline.planners import make_planner
from torc.records import Decision, Evidence
from torc.registry.kinds import TASK_PLANNERS
from torc.registry.loading import part_paths, shipped_paths
from torc.task_planning.protocol import TaskPlanner, ask_planner, rehearse_planner
from torc.testing.contexts import open_context

GOOD = Decision(0, "it is the target")


class _Answers:
    name = "theirs"

    def __init__(self, answer):
        self.answer = answer

    def decide(self, context, rng):
        return self.answer()


def _ask(answer):
    return ask_planner(_Answers(answer), open_context(), np.random.default_rng(0))


def _raise(error):
    raise error


def _endless():
    data = {}
    data["again"] = data
    return data


def test_a_decision_is_handed_on():
    assert _ask(lambda: GOOD) == GOOD
    assert _ask(lambda: Decision(None, "nothing")).object_id is None


def test_numpys_integers_become_plain_ones():
    decision = _ask(lambda: replace(GOOD, object_id=np.int16(2)))
    assert type(decision.object_id) is int
    assert json.loads(json.dumps(to_plain(decision)))["object_id"] == 2


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        (None, "returned None"),
        ({"object_id": 0}, "returned a dict"),
        (Decision("0", "text"), "object_id is a str"),
        (Decision(True, "yes"), "object_id is a bool"),
        (Decision(0, "yes", is_target="0"), "is_target is a str"),
        (replace(GOOD, reason=None), "reason is None"),
        (replace(GOOD, give_up="no"), "give_up is a str"),
        (replace(GOOD, attempts="once"), "attempts is a str"),
        (replace(GOOD, exchanges=("what?",)), "exchanges"),
        (replace(GOOD, evidence=[1]), "evidence is a list"),
        (replace(GOOD, evidence={"pixels": 3}), r"it must be a torc.records.Evidence.*notes="),
        (replace(GOOD, evidence=Evidence(graph=[1, 2])), "evidence.graph is a list"),
        (replace(GOOD, evidence=Evidence(probabilities={"0": 0.5})), "a mapping of object ids to numbers"),
        (replace(GOOD, evidence=Evidence(notes={"set": {1, 2}})), "not plain data"),
        (replace(GOOD, evidence=Evidence(notes=_endless())), "not plain data"),
    ],
)
def test_what_is_no_decision_is_named(answer, text):
    with pytest.raises(PlannerError, match=f"'theirs' gave no valid decision.*{text}"):
        _ask(lambda: answer)


@pytest.mark.parametrize("error", [KeyError("mug"), SystemExit(3)])
def test_a_crash_is_the_planners_and_says_where(error):
    with pytest.raises(
        PlannerError, match=rf"'theirs' failed with {type(error).__name__}: .*test_task_planner_protocol\.py"
    ):
        _ask(lambda: _raise(error))


def test_a_planners_own_clear_error_stays_as_it_is():
    with pytest.raises(InputError, match=r"^no key$"):
        _ask(lambda: _raise(InputError("no key")))
    with pytest.raises(KeyboardInterrupt):
        _ask(lambda: _raise(KeyboardInterrupt()))


def test_a_rehearsal_that_crashes_is_the_planners_too():
    planner = _Answers(lambda: GOOD)
    rehearse_planner(planner, open_context())  # it has none
    planner.warm_up = lambda context: _raise(ValueError("cold"))
    with pytest.raises(PlannerError, match="ValueError: cold"):
        rehearse_planner(planner, open_context())


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("import sys\nsys.exit(2)", "SystemExit"),
        ("class Theirs:\n  def __init__(self): self.key = {}['KEY']", "KeyError: 'KEY'"),
    ],
)
def test_a_planner_that_cannot_be_made_is_bad_input(code, text, tmp_path, monkeypatch):
    (tmp_path / "theirs_unmakable.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "theirs_unmakable", raising=False)
    with pytest.raises(InputError, match=text):
        make_planner("theirs_unmakable:Theirs")


@pytest.mark.parametrize("name", ["random", "dg-select"])
def test_built_in_names_make_planners_of_that_name(name: str) -> None:
    planner = make_planner(name)
    assert isinstance(planner, TaskPlanner)
    assert planner.name == name
    assert name in part_paths(TASK_PLANNERS)


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

    monkeypatch.setattr("torc.registry.loading.entry_points", lambda group: [Point, Impostor])
    assert make_planner("theirs").name == "random"
    assert make_planner("random").name == "random"


def test_built_in_names_import_nothing_until_asked() -> None:
    code = "import sys, torc.pipeline.planners; sys.exit('torc.task_planning.dg_select' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    assert all(path.count(":") == 1 for path in shipped_paths(TASK_PLANNERS).values())
