"""Windows editors begin UTF-8 files with a byte-order mark: every file that a user writes is read with one."""

import shutil
from importlib.resources import files

import pytest

from tests.helpers.fake_trial import play_fake_trial
from torc.benchmark.reading import read_table
from torc.pipeline.planners import make_planner
from torc.problems.problem import load_problem, problem_text
from torc.robots.loading import load_robot
from torc.robots.names import DATA
from torc.specs.trial import TrialSpec
from torc.trials.recorded import read_trial
from torc.vlm.prompt_files import load_prompt, shipped_prompt
from torc.workspace.workspace_files import EXAMPLE, load_workspace

MARK = b"\xef\xbb\xbf"


def marked(path, text):
    path.write_bytes(MARK + text.encode("utf-8"))
    return path


def test_workspaces_and_problems(tmp_path):
    path = marked(tmp_path / "own.yaml", EXAMPLE.read_text(encoding="utf-8"))
    assert load_workspace(path).name == load_workspace("paper").name
    problem = load_problem("structured-01")
    assert load_problem(str(marked(tmp_path / "problem.yaml", problem_text(problem)))).name == problem.name


def test_robots(tmp_path):
    shutil.copytree(DATA, tmp_path / "data")
    path = tmp_path / "data" / "panda_hand" / "panda_hand.yaml"
    marked(path, path.read_text(encoding="utf-8"))
    assert load_robot(path).source == load_robot("panda_hand").source


def test_results_of_trials(tmp_path):
    directory = play_fake_trial(
        TrialSpec.of("boxes", "dg-select"), tmp_path / "boxes", make_planner("dg-select")
    ).directory
    before, row = read_trial(directory), read_table(tmp_path).rows
    for name in ("spec.json", "result.json", "events.jsonl"):
        marked(directory / name, (directory / name).read_text(encoding="utf-8"))
    assert read_trial(directory).picks == before.picks
    assert read_table(tmp_path).rows == row


@pytest.mark.parametrize("name", ["vlm-grasps-1.txt", "vlm-grasps-3.yaml"])
def test_prompts(tmp_path, name):
    text = (files("torc.vlm") / "prompts" / name).read_text(encoding="utf-8")
    found, shipped = load_prompt(marked(tmp_path / name, text)), shipped_prompt(name.split(".")[0])
    assert (found.user, found.system) == (shipped.user, shipped.system)
