"""Parts of somebody else's on the command line: what breaks in them is one clear line, never a traceback."""

import json

import pytest
from torc_command import run_torc

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
