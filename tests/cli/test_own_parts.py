"""Parts of somebody else's on the command line: what breaks in them is one clear line, never a traceback."""

import json

import numpy as np
import pytest
from torc_command import run_torc

from torc.episode.trial import run_trial
from torc.specs.trial import TrialSpec
from torc.testing.synthetic import SyntheticBox, synthetic_observation

PLAN = '{"plan": [{"action": "remove", "input": 2}]}'


@pytest.fixture
def frame(tmp_path):
    """A box before the target, as a file."""
    shapes = [
        SyntheticBox(0, (0.66, -0.33, 1.08), (0.05, 0.05, 0.06)),
        SyntheticBox(1, (0.58, -0.12, 1.15), (0.05, 0.14, 0.20)),
    ]
    o = synthetic_observation(shapes)
    arrays = {"rgb": o.rgb, "depth_m": o.depth_m, "K": o.K, "T_world_camera": o.T_world_camera}
    np.savez(tmp_path / "frame.npz", **arrays, labels=o.label_image + 1, target=1)
    return tmp_path / "frame.npz"


@pytest.fixture
def theirs(tmp_path, monkeypatch):
    """Writes a class of somebody's with that method; returns its name."""

    def write(method, code):
        module = f"part_{abs(hash((method, code)))}"
        lines = [
            "from torc.vlm.replies import reply_of",
            "class Theirs:",
            f"    def {method}:",
            f"        {code}",
        ]
        (tmp_path / f"{module}.py").write_text("\n".join(lines) + "\n")
        monkeypatch.syspath_prepend(tmp_path)
        return f"{module}:Theirs"

    return write


@pytest.mark.parametrize(
    ("method", "code", "status", "told"),
    [
        ("ask(self, question)", f"return reply_of({PLAN!r}, 'mine')", 0, ""),
        (
            "ask(self, question)",
            f"return {PLAN!r}",
            1,
            "VLM client Theirs gave no valid reply: ask() returned a str",
        ),
        ("ask(self, question)", "return question.nothing", 1, "VLM client Theirs failed with AttributeError"),
        ("answer(self, question)", "pass", 2, "needs a method `ask(question)`"),
    ],
)
def test_a_vlm_client(method, code, status, told, frame, theirs, capsys):
    options = ("--planner", "vlm-select", "--vlm", theirs(method, code))
    found, out, err = run_torc("decide", frame, "--json", *options, capsys=capsys)
    assert found == status, err
    assert told in err
    assert status or "mine" in json.loads(out)["reason"]


@pytest.mark.parametrize(
    ("method", "code", "status", "told"),
    [
        (
            "plan(self, scene, volume, rng)",
            "return []",
            1,
            "Grasp planner Theirs gave no valid grasps: plan() returned",
        ),
        (
            "plan(self, scene, volume, rng)",
            "return 1 / 0",
            1,
            "Grasp planner Theirs failed with ZeroDivisionError",
        ),
        ("grasp(self)", "pass", 2, "needs a method `plan(scene, volume, rng)`"),
    ],
)
def test_a_grasp_planner(method, code, status, told, frame, theirs, capsys):
    found, _, err = run_torc("decide", frame, "--json", "--grasps", theirs(method, code), capsys=capsys)
    assert found == status
    assert told in err


@pytest.mark.parametrize(
    "command",
    [
        ("human", "structured-04", "--out", "made"),
        ("problems", "generate", "--out", "made"),
        ("problems", "validate", "structured-04"),
        ("problems", "solve", "structured-04"),
        ("problems", "gallery", "structured-04", "--out", "made"),
        ("problems", "import", "made", "--paper"),
    ],
)
def test_an_unknown_robot_is_refused_before_any_work(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    status, _, err = run_torc(*command, "--robot", "sda10f_2f58", capsys=capsys)
    assert status == 2
    assert "sda10f_2f85" in err
    assert list(tmp_path.iterdir()) == []


def test_a_trial_with_a_broken_part_is_errored_and_one_with_none_is_not_begun(theirs, tmp_path, capsys):
    broken = theirs("plan(self, scene, volume, rng)", "return 1 / 0")
    trial = run_trial(
        TrialSpec.of("structured-04", "random", grasps=broken), tmp_path / "a", say=lambda text: None
    )
    assert trial.result["status"] == "errored"
    assert "Grasp planner Theirs" in trial.result["error"]
    assert "picks" not in trial.result
    assert "ZeroDivisionError" in (tmp_path / "a" / "error.txt").read_text()
    refused = ("--grasps", "no_such:Planner"), ("--grasps", "geometrc"), ("--vlm", "no_such:Client")
    for options in (*refused, ("--robot", "no_such.yaml")):
        out = tmp_path / "b" / "c" / "d"
        planner = ("--planner", "vlm-select") if "--vlm" in options else ()
        status, _, err = run_torc("run", "structured-04", "--out", out, *planner, *options, capsys=capsys)
        assert status == 2
        assert "no_such" in err or "Did you mean 'geometric'" in err
        assert not (tmp_path / "b").exists()


def test_the_simulated_vlm_decides_in_simulated_trials_alone(frame, capsys):
    status, _, err = run_torc("decide", frame, "--planner", "vlm-select", "--vlm", "simulated", capsys=capsys)
    assert status == 2
    assert "torc run --planner vlm-select --vlm simulated" in err
