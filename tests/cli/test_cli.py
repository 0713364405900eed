"""The command line as a user meets it: help, errors, exit codes."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from torc_command import run_torc

import torc
from torc.cli.run import RunCommand
from torc.problems.problem import load_problem, problem_text
from torc.problems.sets import problem_names, problem_sets
from torc.testing.synthetic import SyntheticBox, synthetic_observation


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
    code, out, _ = run_torc(*command, "--help", capsys=capsys)
    assert code == 0
    assert "usage: torc" in out


@pytest.mark.parametrize(("argument", "told"), [("--help", "usage: torc"), ("--version", torc.__version__)])
def test_help_and_version_import_nothing_heavy(argument, told):
    probe = f"""
import sys, torc.cli.main
try:
    torc.cli.main.main(['{argument}'])
finally:
    print([m for m in ('mujoco', 'numba', 'cv2', 'numpy') if m in sys.modules])
"""
    out = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True).stdout
    assert told in out
    assert out.splitlines()[-1] == "[]"


def test_doctor_answers_in_json(capsys):
    code, out, _ = run_torc("doctor", "--json", capsys=capsys)
    assert code in (0, 1)
    first = json.loads(out)[0]
    assert {"name", "ok", "remedy"} <= set(first)
    assert first["name"] == "torc"
    assert first["detail"].startswith(torc.__version__)


def test_problems_are_listed_and_shown(capsys):
    code, out, _ = run_torc("problems", "list", "--json", capsys=capsys)
    rows = json.loads(out)
    assert code == 0
    assert len(rows) >= 10
    _, out, _ = run_torc("problems", "list", capsys=capsys)
    headings = [line for line in out.splitlines() if not line.startswith(" ")]
    assert headings == [f"{s}: {len(problem_names(s))} problems" for s in problem_sets()]
    assert len(out.splitlines()) == len(headings) + len(rows)
    code, out, _ = run_torc("problems", "show", rows[0]["name"], capsys=capsys)
    assert code == 0
    assert rows[0]["description"] in out


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["run", "structured-1"], "Did you mean"),
        (["run", "torc40"], "torc40 is a set of 40 problems: name one of them (torc problems list torc40)"),
        (["run", "no/such/file.yaml"], "no/such/file.yaml"),
        (["run", "--planner", "dg-selct"], "Did you mean 'dg-select'"),
        (["run", "--planner", "nowhere:Nobody"], "nowhere"),
        (["run", "--max-picks", "0"], "at least 1"),
        (["run", "--min-score", "1.5", "--out", "{tmp}/trial"], "from 0 to 1"),
        (["run", "x" * 5000], "Unknown problem"),
        (["problems", "list", "x" * 5000], "Unknown problem or problem set"),
        (["problems", "import", "x" * 5000, "--paper"], "There is no directory"),
        (["objects", "import", "x" * 5000], "There is no file"),
        (["objects", "sheet", "mug", "--out", "/proc/nowhere/sheet.png"], "Choose another --out"),
        (["run", "--out", "/proc/nowhere/trial"], "Choose another --out"),
        (["decide", "no_such_frame.npz"], "no_such_frame.npz"),
        (["decide", "f", "--planner", "oracle"], "oracle needs the simulation: torc run --planner oracle"),
        (["decide", "f", "--planner", "human"], "human needs the simulation: torc human"),
        (["decide", "no_such_frame.npz", "--seed", "-1"], "--seed must be at least 0"),
        (["problems", "show", "nothing-like-it"], "Known:"),
    ],
)
def test_wrong_arguments_get_one_clear_line(arguments, told, tmp_path, capsys):
    code, _, err = run_torc(*(a.replace("{tmp}", str(tmp_path)) for a in arguments), capsys=capsys)
    assert code == 2
    assert list(tmp_path.iterdir()) == []
    assert told in err
    assert "Traceback" not in err


def test_nowhere_to_keep_kernels_gets_one_clear_line(monkeypatch, capsys):
    def run(self):
        raise RuntimeError("cannot cache function 'f': no locator available for file 'kernels.py'")

    monkeypatch.setattr(RunCommand, "run", run)
    code, _, err = run_torc("run", capsys=capsys)
    assert code == 2
    assert "NUMBA_CACHE_DIR" in err


def test_decide_answers_for_a_frame(frame, tmp_path, capsys):
    code, out, _ = run_torc("decide", frame, "--json", "--out", tmp_path / "answer", capsys=capsys)
    answer = json.loads(out[out.index("{") :])
    assert code == 0
    assert answer["label"] == 1  # the target, by the label that the frame gives it
    assert answer["grasps"][0]["p"] == max(g["p"] for g in answer["grasps"])
    assert {p.name for p in (tmp_path / "answer").iterdir()} == {"decision.json", "seen.png", "graph.png"}


def test_decide_without_a_choice_exits_with_a_code_of_its_own(frame, their_planner, capsys):
    name = their_planner("from torc.records import Decision; return Decision(None, 'tired')")
    code, out, _ = run_torc("decide", frame, "--planner", name, capsys=capsys)
    assert code == 3
    assert "What became of the grasps" in out


def test_decide_says_where_it_cannot_write(frame, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    code, _, err = run_torc("decide", frame, "--out", tmp_path / "file", capsys=capsys)
    assert code == 2
    assert "Choose another --out" in err


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--planner", "vlm-select"], "--vlm gemini:MODEL"),
        (["--planner", "vlm-select", "--vlm", "gemni:m"], "Did you mean 'gemini'"),
        (["--planner", "vlm-select", "--vlm", "openai:m@http://me:secret-1@host/v1"], "TORC_VLM_API_KEY"),
        (["--planner", "vlm-select", "--vlm", "anthropic:m"], "export ANTHROPIC_API_KEY"),
        (["--vlm", "openai:m", "--vlm-cache-mode", "replay"], "--vlm-cache DIR"),
        (["--vlm-temperature", "1"], "no --vlm"),
        (
            ["--planner", "random", "--vlm", "anthropic:m"],
            "random asks no model: leave out --vlm, or choose one of vlm-select, vlm-grasps, vlm-fixes-dg",
        ),
        (["--planner", "oracle", "--vlm", "simulated"], "oracle asks no model"),
    ],
)
def test_a_vlm_that_cannot_be_asked_is_said_in_one_line(options, text, tmp_path, capsys, monkeypatch):
    monkeypatch.delenv("ANTHROPIC_API_KEY", raising=False)
    code, _, err = run_torc("run", "structured-01", "--out", tmp_path / "run", *options, capsys=capsys)
    assert code == 2
    assert text in err
    assert "secret-1" not in err
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def their_planner(tmp_path, monkeypatch):
    """Writes a planner of somebody's, with that code for `decide`; returns its name."""

    def write(code):
        module = f"theirs_{abs(hash(code))}"
        lines = [
            "class Theirs:",
            "    name = 'theirs'",
            "    def decide(self, context, rng):",
            f"        {code}",
        ]
        (tmp_path / f"{module}.py").write_text("\n".join(lines))
        monkeypatch.syspath_prepend(tmp_path)
        return f"{module}:Theirs"

    return write


@pytest.mark.parametrize(
    ("code", "told"),
    [("return {'object': 1}", "returned a dict"), ("return context.nothing", "AttributeError")],
)
def test_a_planner_that_fails_is_told_so_without_a_traceback(code, told, frame, their_planner, capsys):
    status, out, err = run_torc("decide", frame, "--json", "--planner", their_planner(code), capsys=capsys)
    assert (status, out) == (1, "")
    assert "Task planner 'theirs'" in err
    assert told in err
    assert "Traceback" not in err


def test_the_least_score_changes_what_can_be_chosen(frame, capsys):
    valid = []
    for least in ("0", "0.8", "1"):
        _, out, _ = run_torc("decide", frame, "--json", "--min-score", least, capsys=capsys)
        valid.append([o["valid_grasps"] for o in json.loads(out)["objects"]])
    assert sum(valid[0]) > sum(valid[1])
    assert valid[2] == valid[0]  # no grasp is certain, so all count again


def test_strangers_text_does_not_reach_the_terminal_raw(capsys, tmp_path):
    evil = tmp_path / "evil.yaml"
    evil.write_text(problem_text(load_problem("structured-01")) + '"\\e]0;owned\\a\\e[2J": 1\n')
    code, _, err = run_torc("problems", "show", evil, capsys=capsys)
    assert code == 2
    assert "\x1b" not in err
    assert "\\x1b]0;owned\\x07" in err


@pytest.mark.parametrize(
    ("error", "code", "told"),
    [
        (
            PermissionError(13, "Permission denied", "/root/x"),
            2,
            "'/root/x' cannot be used: Permission denied",
        ),
        (OSError(28, "No space left on device"), 1, "No space left on device"),
        (OSError("libgomp.so.1: cannot open shared object file"), 1, "torc doctor"),
    ],
)
def test_what_the_machine_refuses_is_one_line(error, code, told, monkeypatch, capsys):
    def run(self):
        raise error

    monkeypatch.setattr(RunCommand, "run", run)
    status, _, err = run_torc("run", capsys=capsys)
    assert status == code
    assert told in err


def test_names_that_the_terminal_cannot_show_are_escaped(tmp_path):
    mesh = tmp_path / os.fsdecode(b"caf\xe9.xyz")
    mesh.write_bytes(b"")
    told = subprocess.run(
        [sys.executable, "-m", "torc.cli.main", "objects", "import", str(mesh)],
        capture_output=True,
        check=False,
        env=os.environ | {"PYTHONIOENCODING": "ascii"},
    )
    assert told.returncode == 1
    assert b"refused" in told.stdout
    assert b"Traceback" not in told.stderr
