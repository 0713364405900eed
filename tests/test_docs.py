"""The documentation speaks of what is there."""

import re
import shlex
from dataclasses import astuple, fields
from pathlib import Path

import pytest

from tests.helpers.fake_vlm import ScriptedVlm
from torc.cli.experiments import read_experiment
from torc.cli.main import parse
from torc.errors import MissingDependencyError
from torc.pipeline import warm_up
from torc.pipeline.frames import forms
from torc.plugins import load_part
from torc.problems.problem import parse_problem
from torc.records import GraspStatus, PickResult, PlanningContext
from torc.robots import schema
from torc.specs.settings import config_class
from torc.stages import CAMERAS, TASK_PLANNERS
from torc.task_planning.graph import EdgeKind
from torc.testing.planner_conformance import check_planner
from torc.testing.vlm_client_conformance import check_client
from torc.vlm.asking import FIELDS
from torc.vlm.config import Asking
from torc.vlm.price_files import parse_prices
from torc.vlm.prompt_files import parse_prompt
from torc.vlm.select import VlmSelectPlanner
from torc.vlm.simulated.profiles import PROFILES

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
VLM = (ROOT / "docs" / "vlm.md").read_text()
PLANNERS = (ROOT / "docs" / "task_planners.md").read_text()


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text()):
        assert link.startswith("http") or (page.parent / link).exists(), link


def _commands(text):
    """The lines of a page's examples that call torc, whole and without comments; no outlines ("...", "[")."""
    lines = [line.strip() for line in text.replace("\\\n", " ").splitlines() if line.startswith("    torc ")]
    lines = [re.split(r"\s+#\s|\s*[|>&]\s", line)[0] for line in lines]
    return [line for line in lines if "..." not in line and "[" not in line]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_commands_are_understood(page):
    for line in _commands(page.read_text()):
        try:
            parse(shlex.split(line)[1:])
        except MissingDependencyError:
            pass  # a command of a satellite, which is not installed
        except SystemExit:
            pytest.fail(f"{page.name}: {line}")


def test_the_page_on_planners_names_all_that_a_planner_meets():
    words = {f"`{field.name}`" for field in fields(PlanningContext)}
    words |= {f"`{name}`" for name in TASK_PLANNERS.built_in} | {f"*{kind.value}*" for kind in EdgeKind}
    words |= {f"`{status.name}`" for status in GraspStatus} | {f"`{result.value}`" for result in PickResult}
    assert {w for w in words if w.lower() not in PLANNERS.lower()} == set()


@pytest.mark.parametrize(
    ("page", "name", "check"),
    [("task_planners.md", "Largest", check_planner), ("vlm.md", "Obedient", check_client)],
)
def test_the_part_on_the_page_conforms(page, name, check):
    (code,) = (block for block in _blocks(page, "python") if f"class {name}" in block)
    names: dict = {}
    exec(code, names)
    check(names[name])


def test_the_prompt_and_the_prices_on_the_page_are_some(tmp_path):
    prompt, prices = _blocks("vlm.md", "yaml")
    for structured in (True, False):
        asking = Asking(prompt=parse_prompt(prompt, "mine", "vlm.md"), structured=structured)
        VlmSelectPlanner(ScriptedVlm(["?"]), asking)
    (tmp_path / "prices.yaml").write_text(prices)
    assert parse_prices(str(tmp_path / "prices.yaml"), "gemini:MODEL").written == 2.5


def test_the_page_on_vlms_names_all_that_prompts_are_filled_with():
    assert {name for name in (*FIELDS, "facts", "relations") if f"`${name}`" not in VLM} == set()


def test_the_page_on_the_simulated_vlm_has_its_numbers():
    rows = [[c.strip() for c in line[1:-1].split("|")] for line in VLM.splitlines() if line.startswith("|")]
    shown = {row[0].strip("`"): tuple(map(float, row[1:])) for row in rows if row[0].strip("`") in PROFILES}
    assert shown == {name: tuple(round(n, 3) for n in astuple(p)[1:]) for name, p in PROFILES.items()}


def _blocks(page, language):
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / "docs" / page).read_text(), re.DOTALL)


@pytest.fixture
def beside_the_examples(tmp_path, monkeypatch):
    """An empty directory to work in, with the examples in it."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _printed(capsys):
    """Lines that were printed, but for the one that only the first test on a machine prints."""
    return [line for line in capsys.readouterr().out.splitlines() if line != warm_up.MESSAGE]


def test_the_code_on_the_page_on_frames_runs(beside_the_examples, capsys):
    for code in _blocks("frames.md", "python"):
        exec(code, {})
    assert _printed(capsys)[1] == "6"
    assert (beside_the_examples / "mine" / "frame.json").is_file()


def test_the_page_on_frames_names_every_key():
    text = (ROOT / "docs" / "frames.md").read_text()
    keys = {*forms.IMAGES, *forms.FILE_KEYS, *forms.DIRECTORY_KEYS}
    assert {key for key in keys if f"`{key}`" not in text} == set()


def test_the_code_on_the_page_on_cameras_runs(beside_the_examples, capsys):
    (code,) = _blocks("cameras.md", "python")
    exec(code, {})
    assert _printed(capsys) == ["(480, 640, 3) True", "1.05"]


@pytest.mark.parametrize("name", [name for name in CAMERAS.built_in if name != "simulated"])
def test_the_page_on_cameras_names_every_camera_and_its_settings(name):
    text = (ROOT / "docs" / "cameras.md").read_text()
    assert f"`{name}`" in text
    config = config_class(load_part(CAMERAS, name))
    told = {f.name for f in fields(config) if re.search(rf"`(camera\.)?{f.name}`|--camera\.{f.name}\b", text)}
    assert told == {f.name for f in fields(config)}


@pytest.mark.long
def test_the_robot_on_the_page_works(beside_the_examples, capsys):
    for name, language in (("my_robot.yaml", "yaml"), ("my_robot.xml", "xml")):
        (beside_the_examples / name).write_text(_blocks("robots.md", language)[0])
    for code in _blocks("robots.md", "python"):
        exec(code, {})
    *read, played = _printed(capsys)
    assert (read, played.split()[0]) == (["6 0.085", "6"], "True")


def test_the_page_on_robots_names_every_field():
    text = (ROOT / "docs" / "robots.md").read_text()
    words = {name for name in schema.RobotFile.model_fields if name in ("format", "name", "mjcf")}
    for prefix, part in (
        ("arm.", schema.ArmEntry),
        ("gripper.", schema.GripperEntry),
        ("gripper.fingers[].", schema.FingerEntry),
        ("spheres.", schema.SphereEntry),
        ("self_collision.", schema.SelfCollisionEntry),
    ):
        words |= {prefix + name for name in part.model_fields}
    assert {word for word in words if f"`{word}`" not in text} == set()


def test_the_problem_on_the_page_is_one():
    (text,) = _blocks("problem_files.md", "yaml")
    assert parse_problem(text).target == "can"


def test_the_code_on_the_pages_on_stages_and_workspaces_runs(beside_the_examples, capsys):
    for page in ("stages.md", "workspaces.md"):
        for code in _blocks(page, "python"):
            exec(code, {})
    assert _printed(capsys) == ["structured-01-dg-select-blob_perception.Blobs-0", "high camera 1.05"]


def test_the_experiment_on_the_page_is_one(tmp_path):
    (text,) = _blocks("stages.md", "yaml")
    (tmp_path / "experiment.yaml").write_text(text)
    found = read_experiment(tmp_path / "experiment.yaml")
    assert found["sweep"] == ("occlusion.smooth_px=0,3",)
    assert found["own_planners"][1] == ("dg-select", {"relations.closeness_m": 0.01})
    assert found["conditions"].noise
