"""What is mistyped or cannot be is told in one clear line, before any work, and leaves nothing."""

import json
import shlex

import pytest

from tests.helpers.torc_command import run_torc

NAMED = "a" * 5000
CASES = [
    ("", "usage: torc COMMAND"),
    ("rnu", "Unknown torc command 'rnu'. Did you mean 'run'?"),
    ("problems lst", "Unknown torc problems command 'lst'. Did you mean 'list'?"),
    ("run --sed 3", "--seed INT"),
    ("run structured-1", "Did you mean 'structured-01'?"),
    ("run --planner dg-selct", "Did you mean 'dg-select'"),
    ("run --planner human", "torc human"),
    ("run --max-picks 0", "at least 1"),
    ("run --out /proc/nowhere/trial", "Choose another --out"),
    ("run --robot no_such.yaml", "no_such"),
    ("run --grasps no_such:Planner", "no_such"),
    ("run --planner vlm-select", "--vlm gemini:MODEL"),
    ("run --planner vlm-select --vlm openai:m@http://me:secret-1@host/v1", "TORC_VLM_API_KEY"),
    ("run --vlm openai:m --vlm-cache-mode replay", "--vlm-cache DIR"),
    ("run --vlm-temperature 1", "no --vlm"),
    (
        "run --planner random --vlm anthropic:m",
        "random asks no model: leave out --vlm, or choose one of vlm-fixes-dg, vlm-grasps, vlm-select",
    ),
    ("decide no_such_frame.npz", "no_such_frame.npz"),
    ("decide f --planner oracle", "oracle needs the simulation: torc run --planner oracle"),
    (f"problems list {NAMED}", "Unknown problem or problem set"),
    ("problems show nothing-like-it", "Known:"),
    ("problems solve structured-01 --budget 0", "number of simulated picks"),
    ("problems gallery structured-04 --answers /nowhere", "no directory '/nowhere' of answers"),
    ("problems generate --objects many", "8-20"),
    ("problems generate --kinds soup_cna", "Did you mean 'soup_can'"),
    ("problems generate --count 0", "at least 1"),
    ("problems generate --out /proc/nowhere", "'/proc/nowhere' cannot be used"),
    ("problems validate", "at least one"),
    ("problems import empty --scene 249", "not the root of GraspClutter6D"),
    ("objects import", "Give mesh files"),
    ("objects import nowhere.stl", "no file or directory nowhere.stl"),
    ("objects import a.stl --scale 0", "scale must be between"),
    ("objects import a.stl --library /proc/no", "Objects cannot be kept in /proc/no"),
    ("objects import a.stl --description 'the\nmug'", "A description is a line"),
    ("objects show mug_rad", "Did you mean 'mug_red'"),
    ("objects show mug_red --picture x.gif", "x.gif: pictures are written as .png"),
    ("objects sheet die_red --out sheet.xyz", "written as .jpg or .png"),
    ("report empty", "no finished trial"),
    ("view nowhere", "'nowhere' is not a directory. `torc run --out DIR` makes one"),
    ("view empty", "no recorded trial"),
    ("human --experts a/b", "expert's name"),
    ("human --port 99999 --out empty", "--port"),
    ("human --host no.such.host.invalid --out empty", "Cannot listen"),
    *(
        (f"{command} --robot sda10f_2f58", "sda10f_2f85")
        for command in (
            "human structured-04 --out made",
            "problems generate --out made",
            "problems validate structured-04",
            "problems solve structured-04",
            "problems gallery structured-04 --out made",
            "problems import made --paper",
        )
    ),
]


@pytest.mark.parametrize(("command", "told"), CASES, ids=[command[:60] for command, _ in CASES])
def test_wrong_arguments_get_one_clear_line(command, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("ANTHROPIC_API_KEY", raising=False)
    (tmp_path / "empty").mkdir()
    (tmp_path / "a.stl").touch()
    code, _, err = run_torc(*shlex.split(command), capsys=capsys)
    assert code == 2
    assert told in err.replace("\n", " ")
    assert "secret-1" not in err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.stl", "empty"]


PLAN = '{"plan": [{"action": "remove", "input": 2}]}'


ASK, DECIDE, GRASP = "ask(self, question)", "decide(self, context, rng)", "plan(self, scene, volume, rng)"
REPLY = f"from torc.vlm.replies import reply_of; return reply_of({PLAN!r}, 'mine')"


@pytest.mark.parametrize(
    ("option", "method", "code", "status", "told"),
    [
        ("--vlm", ASK, REPLY, 0, ""),
        ("--vlm", ASK, f"return {PLAN!r}", 1, "VLM client Theirs gave no valid reply: ask() returned a str"),
        ("--vlm", ASK, "return question.nothing", 1, "VLM client Theirs failed with AttributeError"),
        ("--vlm", "answer(self, question)", "pass", 2, "needs a method `ask(question)`"),
        ("--grasps", GRASP, "return []", 1, "Grasp planner Theirs gave no valid grasps: plan() returned"),
        ("--grasps", GRASP, "return 1 / 0", 1, "Grasp planner Theirs failed with ZeroDivisionError"),
        (
            "--planner",
            DECIDE,
            "return {'object': 1}",
            1,
            "Task planner 'theirs' gave no valid decision: decide() returned",
        ),
        ("--planner", DECIDE, "return context.nothing", 1, "AttributeError"),
        ("--grasps", "grasp(self)", "pass", 2, "needs a method `plan(scene, volume, rng)`"),
    ],
)
def test_a_part_of_somebody_elses(option, method, code, status, told, frame, theirs, capsys):
    planner = "vlm-select" if option == "--vlm" else "dg-select"
    options = ("--planner", planner, option, theirs(method, code))  # of one given twice the latter counts
    found, out, err = run_torc("decide", frame, "--json", *options, capsys=capsys)
    assert found == status, err
    assert told in err
    assert status or "mine" in json.loads(out)["reason"]
