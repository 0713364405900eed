"""Core and satellites: the core imports none of them, and they use only its doors and nothing of each other."""

import ast
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest

import torc
from torc.satellites import SATELLITES

PACKAGES = Path(__file__).parents[1] / "packages"
CORE = Path(torc.__file__).parent
MODULES = {s.module for s in SATELLITES}
DOORS = {
    "torc",
    "torc.benchmark.comparison",
    "torc.benchmark.intervals",
    "torc.benchmark.manifest",
    "torc.benchmark.measures",
    "torc.benchmark.paper",
    "torc.benchmark.preflight",
    "torc.benchmark.report.cells",
    "torc.benchmark.report.pages",
    "torc.benchmark.report.tables",
    "torc.benchmark.rows",
    "torc.benchmark.spec",
    "torc.benchmark.store",
    "torc.brain.seeing",
    "torc.cli.commands",
    "torc.cli.object_sheet",
    "torc.cli.planner_options",
    "torc.cli.printing",
    "torc.cli.vlm_options",
    "torc.cli.wanted",
    "torc.cli.web_page",
    "torc.collision.checks",
    "torc.collision.kernels",
    "torc.collision.obstacles",
    "torc.collision.placement",
    "torc.collision.world",
    "torc.episode.events",
    "torc.episode.ideal",
    "torc.episode.log_writing",
    "torc.episode.loop",
    "torc.episode.oracle.solve",
    "torc.episode.pick_view",
    "torc.episode.pictures",
    "torc.episode.planners",
    "torc.episode.privileged",
    "torc.episode.progress",
    "torc.episode.recorder",
    "torc.episode.simulated",
    "torc.episode.steps",
    "torc.episode.trial",
    "torc.episode.viewer_links",
    "torc.errors",
    "torc.files.reading",
    "torc.files.strict_yaml",
    "torc.fingerprints",
    "torc.geometry.transforms",
    "torc.grasping.clouds",
    "torc.grasping.config",
    "torc.grasping.generators",
    "torc.grasping.hand",
    "torc.grasping.planner",
    "torc.grasping.protocol",
    "torc.gym_env.env",
    "torc.interrupts",
    "torc.motion.asking",
    "torc.motion.config",
    "torc.motion.free_motions",
    "torc.motion.geometry",
    "torc.motion.holding",
    "torc.motion.planner",
    "torc.motion.protocol",
    "torc.motion.space",
    "torc.motion.timed_motions",
    "torc.motion.timing",
    "torc.objects.library",
    "torc.occlusion.volume",
    "torc.perception.asking",
    "torc.perception.disparity",
    "torc.perception.embedded.inputs",
    "torc.perception.embedded.perception",
    "torc.perception.embedded.region",
    "torc.perception.from_masks",
    "torc.perception.marking",
    "torc.perception.protocol",
    "torc.perception.segmentation",
    "torc.perception.stereo",
    "torc.perception.target",
    "torc.pipeline.better_bet",
    "torc.pipeline.building",
    "torc.pipeline.frames",
    "torc.pipeline.frames.checks",
    "torc.pipeline.frames.level",
    "torc.pipeline.frames.values",
    "torc.pipeline.look",
    "torc.pipeline.state",
    "torc.pipeline.warm_up",
    "torc.plugins",
    "torc.problems.problem",
    "torc.problems.sets",
    "torc.processes",
    "torc.records",
    "torc.records.directories",
    "torc.records.files",
    "torc.records.serialization",
    "torc.robots.description",
    "torc.robots.execution",
    "torc.robots.gripper",
    "torc.robots.ik",
    "torc.robots.kinematics",
    "torc.robots.loading",
    "torc.robots.protocols",
    "torc.sim.actuation",
    "torc.sim.portraits",
    "torc.sim.robot",
    "torc.sim.stepping",
    "torc.sim.world",
    "torc.specs.conditions",
    "torc.specs.files",
    "torc.specs.settings",
    "torc.specs.trial",
    "torc.stages",
    "torc.task_planning.asking",
    "torc.task_planning.dg_select",
    "torc.task_planning.expected_picks",
    "torc.task_planning.protocol",
    "torc.task_planning.random_choice",
    "torc.task_planning.relations",
    "torc.testing.conformance",
    "torc.vlm.answers",
    "torc.vlm.cache",
    "torc.vlm.config",
    "torc.vlm.failures",
    "torc.vlm.numerals",
    "torc.vlm.opening",
    "torc.vlm.picture_config",
    "torc.vlm.pictures",
    "torc.vlm.prices",
    "torc.vlm.protocol",
    "torc.vlm.question_facts",
    "torc.vlm.replies",
    "torc.vlm.select",
    "torc.vlm.simulated.client",
    "torc.vlm.simulated.profiles",
    "torc.vlm.simulated.situation",
    "torc.web.app",
    "torc.web.camera_page",
    "torc.web.frames",
    "torc.web.shelf",
    "torc.workspace.description",
    "torc.workspace.files",
}
"""Modules of the core that satellites import: the shorter this list, the better."""
HELPERS = {
    "fake_bench",
    "fake_robot",
    "fake_trial",
    "full_geometry",
    "harness_environments",
    "marks",
    "motion_checker",
    "torc_command",
    "vlm_server",
}
"""Helpers of the core's tests that the satellites' tests may use, too."""


@cache
def _imports(path):
    """The modules that a file imports, and the names that it takes from them, anywhere in it."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += [(alias.name, "") for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found += [(node.module or "", alias.name) for alias in node.names]
    return found


def _module(name, member):
    """The module of the core that an import leads to."""
    path = CORE.parent.joinpath(*name.split("."), member or "?")
    return f"{name}.{member}" if path.is_dir() or path.with_suffix(".py").is_file() else name


def _of_core(path):
    return {(_module(m, n), n) for m, n in _imports(path) if m == "torc" or m.startswith("torc.")}


def _sources(satellite):
    return sorted((PACKAGES / satellite.package / "src").rglob("*.py"))


def test_the_core_imports_no_satellite():
    """Not within functions either, nor by a name in a string, but by entry points alone."""
    named = re.compile(rf"\b({'|'.join(MODULES)})[.:]")
    for path in CORE.rglob("*.py"):
        assert not {m.split(".")[0] for m, _ in _imports(path)} & MODULES, path
        strings = (n.value for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Constant))
        assert not [s for s in strings if isinstance(s, str) and named.search(s)], path


@pytest.mark.parametrize("satellite", SATELLITES, ids=lambda s: s.package)
def test_a_satellite_imports_only_itself_and_what_the_core_opens(satellite):
    for path in _sources(satellite):
        foreign = {m for m, _ in _imports(path) if m.split(".")[0] in MODULES - {satellite.module}}
        assert foreign == set(), path
        used = _of_core(path)
        assert {m for m, _ in used} - DOORS == set(), path
        assert [name for _, name in used if name.startswith("_")] == [], path


def test_every_door_is_used():
    used = {m for s in SATELLITES for path in _sources(s) for m, _ in _of_core(path)}
    assert DOORS - used == set()


@pytest.mark.parametrize("satellite", SATELLITES, ids=lambda s: s.package)
def test_tests_of_a_satellite_borrow_only_these_helpers(satellite):
    for path in (PACKAGES / satellite.package / "tests").rglob("*.py"):
        names = {m for m, _ in _imports(path)}
        assert not {m.split(".")[0] for m in names} & (MODULES - {satellite.module}), path
        borrowed = {m.removeprefix("tests.helpers.") for m in names if m.startswith("tests.")}
        assert borrowed - HELPERS == set(), path


@pytest.mark.parametrize("satellite", SATELLITES, ids=lambda s: s.package)
def test_the_table_of_satellites_is_what_they_register(satellite):
    project = tomllib.loads((PACKAGES / satellite.package / "pyproject.toml").read_text())["project"]
    groups = project["entry-points"]
    assert project["name"] == satellite.package
    assert set(groups["torc.commands"]) == set(satellite.commands)
    parts = {g: set(names) for g, names in groups.items() if g in satellite.parts}
    assert parts == {g: set(names) for g, names in satellite.parts.items()}
    extras = tomllib.loads((PACKAGES.parent / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    for extra in {satellite.extra, *(e for names in satellite.parts.values() for e in names.values())}:
        assert any(wanted.startswith(satellite.package) for wanted in extras[extra])
