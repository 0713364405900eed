"""The documentation agrees with the code: links, commands, snippets, names and numbers."""

import re
import shlex
from dataclasses import astuple, fields
from pathlib import Path

import pytest

from tests.helpers.fake_vlm import ScriptedVlm
from tests.test_architecture import ORDER
from tools import extension_points
from torc.cli.experiments import read_experiment
from torc.cli.main import parse
from torc.errors import MissingDependencyError
from torc.perception.from_masks import Masks
from torc.pipeline import warm_up
from torc.pipeline.frames import forms
from torc.pipeline.planners import is_reference
from torc.problems.problem import parse_problem
from torc.records import GraspSet, GraspStatus, PickResult, PlanningContext, Trajectory
from torc.records.graph import EdgeKind
from torc.registry.kinds import ARM_DRIVERS, CAMERAS, GRIPPER_DRIVERS, STAGES, TASK_PLANNERS
from torc.registry.loading import load_part, shipped_paths
from torc.registry.settings import config_class
from torc.robots import schema
from torc.testing.planner_conformance import check_planner
from torc.testing.vlm_client_conformance import check_client
from torc.vlm.asker import FIELDS
from torc.vlm.config import Asking
from torc.vlm.planners import VlmSelectPlanner
from torc.vlm.price_files import parse_prices
from torc.vlm.prompt_files import parse_prompt
from torc.vlm.simulated.profiles import PROFILES

ROOT = Path(__file__).parents[1]
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))]
PAGES += [p for p in sorted((ROOT / "results").rglob("*.md")) if p.name != "report.md"]
NAMES = [str(p.relative_to(ROOT)) for p in PAGES]
VLM = (ROOT / "docs" / "vlm.md").read_text()
PLANNERS = (ROOT / "docs" / "task_planners.md").read_text()


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_links_lead_somewhere(page):
    for link, anchor in re.findall(r"\]\(([^)#\s]*)(?:#([^)]*))?\)", page.read_text()):
        target = page.parent / link if link else page
        assert link.startswith("http") or target.exists(), link
        if anchor and target.suffix == ".md":
            assert anchor in _anchors(target), f"{link}#{anchor}"


def _anchors(page):
    """Return the anchors of a page's headings, as code hosts and mkdocs make them."""
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    headings = re.findall(r"^#+ +(.+)$", text, re.MULTILINE)
    return {re.sub(r"\s+", "-", re.sub(r"[^\w\s-]", "", h).strip().lower()) for h in headings}


def test_messages_name_pages_that_exist():
    for folder in ("src", "packages", "tools", "benchmarks", "examples"):
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in (".py", ".yaml", ".ipynb"):
                for name in re.findall(r"\b(?:docs|results)/[\w/-]+\.md", path.read_text()):
                    assert (ROOT / name).is_file(), f"{path.relative_to(ROOT)}: {name}"


def test_the_table_of_packages_is_the_order_of_imports():
    rows = re.findall(r"^\| `(\w+)` \|", (ROOT / "CONTRIBUTING.md").read_text(), re.MULTILINE)
    assert rows == [*ORDER, "testing"]


def _commands(text):
    """The lines of a page's examples that call torc, whole and without comments; no outlines ("...", "[")."""
    lines = [line.strip() for line in text.replace("\\\n", " ").splitlines() if line.startswith("    torc ")]
    lines = [re.split(r"\s+#\s|\s*[|>&]\s", line)[0] for line in lines]
    return [line for line in lines if "..." not in line and "[" not in line]


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_commands_are_understood(page):
    for line in _commands(page.read_text()):
        try:
            parse(shlex.split(line)[1:])
        except MissingDependencyError:
            pass  # a command of a satellite, which is not installed
        except SystemExit:
            pytest.fail(f"{page.name}: {line}")


def test_the_table_of_parts_is_that_of_today():
    text = extension_points.PAGE.read_text()
    assert extension_points.page(text) == text
    assert text.count(extension_points.table()) == 1


def test_the_page_on_planners_names_all_that_a_planner_meets():
    words = {f"`{field.name}`" for field in fields(PlanningContext)}
    shown = [name for name in shipped_paths(TASK_PLANNERS) if name != "human" and not is_reference(name)]
    words |= {f"`{name}`" for name in shown} | {f"*{kind.value}*" for kind in EdgeKind}
    words |= {f"`{status.name}`" for status in GraspStatus} | {f"`{result.value}`" for result in PickResult}
    assert {w for w in words if w.lower() not in PLANNERS.lower()} == set()


@pytest.mark.parametrize(
    ("page", "name", "check"),
    [("extending.md", "Deep", check_planner), ("vlm.md", "Obedient", check_client)],
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
    """Lines that were printed, but for those that only the first test on a machine prints."""
    lines = capsys.readouterr().out.splitlines()
    return [line for line in lines if line != warm_up.MESSAGE and " kernels after " not in line]


def test_the_code_on_the_page_on_frames_runs(beside_the_examples, capsys):
    for code in _blocks("frames.md", "python"):
        exec(code, {})
    assert _printed(capsys)[1] == "6"
    assert (beside_the_examples / "mine" / "frame.json").is_file()


def test_the_page_on_frames_names_every_key():
    text = (ROOT / "docs" / "frames.md").read_text()
    keys = {*forms.IMAGES, *forms.KEYS}
    assert {key for key in keys if f"`{key}`" not in text} == set()


def test_the_code_on_the_page_on_cameras_runs(beside_the_examples, capsys):
    (code,) = _blocks("cameras.md", "python")
    exec(code, {})
    assert _printed(capsys) == ["(480, 640, 3) True", "1.05"]


@pytest.mark.parametrize("name", [name for name in shipped_paths(CAMERAS) if name != "simulated"])
def test_the_page_on_cameras_names_every_camera_and_its_settings(name):
    text = (ROOT / "docs" / "cameras.md").read_text()
    assert f"`{name}`" in text
    config = config_class(load_part(CAMERAS, name))
    named = {
        f.name for f in fields(config) if re.search(rf"`(camera\.)?{f.name}`|--camera\.{f.name}\b", text)
    }
    assert named == {f.name for f in fields(config)}


@pytest.mark.long
def test_the_robot_on_the_page_works(beside_the_examples, capsys):
    for name, language in (("my_robot.yaml", "yaml"), ("my_robot.xml", "xml")):
        (beside_the_examples / name).write_text(_blocks("robots.md", language)[0])
    for code in _blocks("robots.md", "python"):
        exec(code, {})
    *read, played, workspace = _printed(capsys)
    assert (read, played.split()[0]) == (["6 0.085", "6"], "True")
    assert workspace == "high camera 1.05"


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
    (text,) = _blocks("problems.md", "yaml")
    assert parse_problem(text).target == "can"


@pytest.mark.long
def test_the_code_on_the_page_on_extending_runs(beside_the_examples, capsys):
    names: dict = {}
    for code in _blocks("extending.md", "python"):
        exec(code.replace("max_picks=2", "max_picks=1"), names)
    step, ended, trial, table, name = _printed(capsys)
    assert step == "removed"
    assert ended == "False budget spent 1"
    assert trial == "completed 1"
    assert table.startswith("[('deep', ")
    assert name == "structured-01-dg-select-blob_perception.Blobs-0"


def test_the_page_on_extending_names_every_member_and_every_group():
    text = (ROOT / "docs" / "extending.md").read_text()
    words = {field.name for record in (Masks, GraspSet, Trajectory) for field in fields(record)}
    assert {w for w in words if not re.search(rf"`(\w+\()?{w}\b", text)} == set()
    kinds = (*STAGES.values(), TASK_PLANNERS, ARM_DRIVERS, GRIPPER_DRIVERS)
    assert {kind.group for kind in kinds if f"`{kind.group}`" not in text} == set()


def test_the_experiment_on_the_page_is_one(tmp_path):
    (text,) = _blocks("benchmarking.md", "yaml")
    (tmp_path / "experiment.yaml").write_text(text)
    found = read_experiment(tmp_path / "experiment.yaml")
    assert found["sweep"] == ("occlusion.smooth_px=0,3",)
    assert found["own_planners"][1] == ("dg-select", {"relations.closeness_m": 0.01})
    assert found["conditions"].noise
