"""The command line as a user meets it: help, errors, exit codes."""

import importlib
import json
import os
import subprocess
import sys

import pytest

import torc
from tests.helpers.marks import long
from tests.helpers.torc_command import run_torc
from torc.cli.commands import Group
from torc.cli.doctor import DoctorCommand
from torc.cli.main import TORC
from torc.errors import InputError
from torc.problems.problem import load_problem, problem_text
from torc.problems.sets import problem_names, problem_sets

DECIDE = "decide(self, context, rng)"


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


def test_decide_answers_for_a_frame(frame, tmp_path, capsys):
    code, out, _ = run_torc("decide", frame, "--json", "--out", tmp_path / "answer", capsys=capsys)
    answer = json.loads(out[out.index("{") :])
    assert code == 0
    assert answer["label"] == 1  # the target, by the label that the frame gives it
    assert answer["grasps"][0]["p"] == max(g["p"] for g in answer["grasps"])
    assert {p.name for p in (tmp_path / "answer").iterdir()} == {"decision.json", "seen.png", "graph.png"}


def test_decide_without_a_choice_exits_with_a_code_of_its_own(frame, theirs, capsys):
    name = theirs(DECIDE, "from torc.records import Decision; return Decision(None, 'tired')")
    code, out, _ = run_torc("decide", frame, "--planner", name, capsys=capsys)
    assert code == 3
    assert "What became of the grasps" in out


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


_load = importlib.import_module


def test_a_library_that_cannot_be_loaded_gets_its_remedy(monkeypatch, capsys):
    def load(name, package=None):
        if name == "cv2":
            raise ModuleNotFoundError("No module named 'cv2'")
        return _load(name, package)

    monkeypatch.setattr(importlib, "import_module", load)
    assert DoctorCommand().run() == 1
    out = capsys.readouterr().out
    assert "MISS  library: cv2: No module named 'cv2'\n      -> pip install opencv-python-headless\n" in out


def leaves(group=TORC, path=()):
    """Every command that is none but a group, by its words."""
    for name in group.commands:
        if isinstance(command := group.command(name), Group):
            yield from leaves(command, (*path, name))
        else:
            yield (*path, name)


@pytest.mark.parametrize("words", [(), ("problems",), ("objects",), *leaves()], ids=" ".join)
def test_help_fits_eighty_columns(words, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = run_torc(*words, "--help", capsys=capsys)
    assert code == 0
    assert f"usage: torc {' '.join(words)}".strip() in out
    assert [line for line in out.splitlines() if len(line) > 80 and not line.startswith("usage:")] == []


@pytest.mark.parametrize("words", [["--help"], ["objects", "list"], ["run", "--help"]], ids=" ".join)
def test_a_reader_that_went_away_is_no_fault(words):
    reader, writer = os.pipe()
    os.close(reader)
    torc = [sys.executable, "-m", "torc.cli.main", *words]
    buffered = {k: v for k, v in os.environ.items() if k != "PYTHONUNBUFFERED"}
    ended = subprocess.run(torc, stdout=writer, stderr=subprocess.PIPE, env=buffered, check=False)
    os.close(writer)
    assert (ended.returncode, ended.stderr) == (141, b"")


@pytest.mark.parametrize("name", ["cgl", *long("nonsense")])
def test_a_gl_library_that_mujoco_does_not_know_is_told(name):
    environment = {**os.environ, "MUJOCO_GL": name}
    for arguments, code in ((["doctor"], 1), (["run", "structured-01"], 2)):
        ended = subprocess.run(
            [sys.executable, "-m", "torc.cli.main", *arguments],
            env=environment,
            capture_output=True,
            text=True,
        )
        text = ended.stdout + ended.stderr
        assert ended.returncode == code
        assert "Unset" in text
        assert "Traceback" not in text


@pytest.mark.parametrize(
    ("options", "kept"),
    [
        ("", set()),
        ("--video", {"video"}),
        ("--trajectory", {"trajectory"}),
        ("--save-records", {"snapshots"}),
    ],
)
def test_run_keeps_what_it_is_asked_for(options, kept, monkeypatch, tmp_path, capsys):
    asked = {}

    def played(*_, recording, **__):
        asked.update(vars(recording))
        raise InputError("enough")

    monkeypatch.setattr("torc.trials.trial.run_trial", played)
    run_torc("run", "structured-01", "--out", tmp_path / "trial", *options.split(), capsys=capsys)
    assert {name for name, value in asked.items() if value} == kept | {"pictures"}
