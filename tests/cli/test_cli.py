"""The command line as a user meets it: help, errors, exit codes."""

import json
import subprocess
import sys

import numpy as np
import pytest

from torc.cli.main import main
from torc.testing.synthetic import SyntheticBox, synthetic_observation


def _torc(*arguments, capsys):
    with pytest.raises(SystemExit) as exit_:
        main([str(a) for a in arguments])
    out, err = capsys.readouterr()
    return exit_.value.code, out, err


@pytest.fixture
def frame(tmp_path):
    shapes = [
        SyntheticBox(0, (0.66, -0.33, 1.08), (0.05, 0.05, 0.06)),
        SyntheticBox(1, (0.58, -0.12, 1.15), (0.05, 0.14, 0.20)),
    ]
    o = synthetic_observation(shapes)
    path = tmp_path / "frame.npz"
    np.savez(
        path,
        rgb=o.rgb,
        depth_m=o.depth_m,
        K=o.K,
        T_world_camera=o.T_world_camera,
        labels=o.label_image + 1,
        target=1,
    )
    return path


@pytest.mark.parametrize("command", [[], ["run"], ["decide"], ["problems"], ["problems", "show"], ["doctor"]])
def test_every_command_has_help(command, capsys):
    code, out, _ = _torc(*command, "--help", capsys=capsys)
    assert code == 0
    assert "usage: torc" in out


def test_help_imports_nothing_heavy():
    probe = "import sys, torc.cli.main; print([m for m in ('mujoco', 'numba', 'cv2', 'numpy') if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "[]"


def test_doctor_answers_in_json(capsys):
    code, out, _ = _torc("doctor", "--json", capsys=capsys)
    assert code in (0, 1)
    assert {"name", "ok", "remedy"} <= set(json.loads(out)[0])


def test_problems_are_listed_and_shown(capsys):
    code, out, _ = _torc("problems", "list", "--json", capsys=capsys)
    rows = json.loads(out)
    assert code == 0
    assert len(rows) >= 10
    code, out, _ = _torc("problems", "show", rows[0]["name"], capsys=capsys)
    assert code == 0
    assert rows[0]["description"] in out


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["run", "structured-1"], "Did you mean"),
        (["run", "no/such/file.yaml"], "no/such/file.yaml"),
        (["run", "--planner", "dg-selct"], "Did you mean 'dg-select'"),
        (["run", "--planner", "nowhere:Nobody"], "nowhere"),
        (["run", "--max-picks", "0"], "at least 1"),
        (["run", "--out", "/proc/nowhere/trial"], "Choose another --out"),
        (["decide", "no_such_frame.npz"], "no_such_frame.npz"),
        (["problems", "show", "nothing-like-it"], "Known:"),
    ],
)
def test_wrong_arguments_get_one_clear_line(arguments, told, capsys):
    code, _, err = _torc(*arguments, capsys=capsys)
    assert code == 2
    assert told in err
    assert "Traceback" not in err


def test_decide_answers_for_a_frame(frame, tmp_path, capsys):
    code, out, _ = _torc("decide", frame, "--json", "--out", tmp_path / "answer", capsys=capsys)
    answer = json.loads(out[out.index("{") :])
    assert code == 0
    assert answer["label"] == 1  # the target, by the label that the frame gives it
    assert {p.name for p in (tmp_path / "answer").iterdir()} == {"decision.json", "seen.png", "graph.png"}


def test_decide_says_where_it_cannot_write(frame, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    code, _, err = _torc("decide", frame, "--out", tmp_path / "file", capsys=capsys)
    assert code == 2
    assert "Choose another --out" in err
