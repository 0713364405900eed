"""Windows editors begin UTF-8 files with a byte-order mark: every file that a user writes is read with one."""

import shutil

import pytest

from torc.lab.lab_file import example_labs, load_lab
from torc.problems.problem import load_problem, problem_text
from torc.robots.loading import load_robot
from torc.robots.names import DATA
from torc.workspace.files import EXAMPLE, load_workspace

MARK = b"\xef\xbb\xbf"


def marked(path, text):
    path.write_bytes(MARK + text.encode("utf-8"))
    return path


def test_workspaces_problems_and_lab_files(tmp_path):
    path = marked(tmp_path / "own.yaml", EXAMPLE.read_text(encoding="utf-8"))
    assert load_workspace(path).name == load_workspace("paper").name
    problem = load_problem("structured-01")
    assert load_problem(str(marked(tmp_path / "problem.yaml", problem_text(problem)))).name == problem.name
    pytest.importorskip("websockets")
    assert load_lab(marked(tmp_path / "lab.yaml", example_labs()["ur5e-ros2"])).name == "ur5e-ros2"


def test_robots(tmp_path):
    shutil.copytree(DATA, tmp_path / "data")
    path = tmp_path / "data" / "panda_hand" / "panda_hand.yaml"
    marked(path, path.read_text(encoding="utf-8"))
    assert load_robot(path).source == load_robot("panda_hand").source
