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
    "torc.collision.collision_world",
    "torc.collision.contact_kernels",
    "torc.collision.contacts",
    "torc.collision.obstacles",
    "torc.collision.placement",
    "torc.drawing.marking",
    "torc.drawing.strip",
    "torc.episode.events",
    "torc.episode.log",
    "torc.episode.loop",
    "torc.episode.pick_view",
    "torc.episode.privileged",
    "torc.episode.progress",
    "torc.episode.recorder",
    "torc.episode.simulated",
    "torc.episode.steps",
    "torc.episode.trial",
    "torc.episode.viewer_links",
    "torc.errors",
    "torc.geometry.transforms",
    "torc.grasping.clouds",
    "torc.grasping.config",
    "torc.grasping.generators",
    "torc.grasping.geometric_planner",
    "torc.grasping.hand",
    "torc.grasping.protocol",
    "torc.gym_env.env",
    "torc.interrupts",
    "torc.io.digests",
    "torc.io.pictures",
    "torc.io.reading",
    "torc.io.record_files",
    "torc.io.results",
    "torc.io.strict_yaml",
    "torc.motion.config",
    "torc.motion.free_motions",
    "torc.motion.geometry",
    "torc.motion.holding",
    "torc.motion.protocol",
    "torc.motion.sampling_planner",
    "torc.motion.space",
    "torc.motion.timed_motions",
    "torc.motion.timing",
    "torc.objects.library",
    "torc.occlusion.volume",
    "torc.oracle.ideal",
    "torc.oracle.solve",
    "torc.perception.checked_scenes",
    "torc.perception.embedded.inputs",
    "torc.perception.embedded.perception",
    "torc.perception.from_masks",
    "torc.perception.protocol",
    "torc.perception.segmentation",
    "torc.perception.stereo",
    "torc.perception.target",
    "torc.pipeline.better_bet",
    "torc.pipeline.building",
    "torc.pipeline.frames",
    "torc.pipeline.frames.level",
    "torc.pipeline.frames.plausibility",
    "torc.pipeline.frames.values",
    "torc.pipeline.planners",
    "torc.pipeline.state",
    "torc.pipeline.warm_up",
    "torc.problems.problem",
    "torc.problems.sets",
    "torc.processes",
    "torc.records",
    "torc.registry.context",
    "torc.registry.kinds",
    "torc.registry.loading",
    "torc.registry.settings",
    "torc.robots.description",
    "torc.robots.execution",
    "torc.robots.gripper",
    "torc.robots.ik",
    "torc.robots.kinematics",
    "torc.robots.protocols",
    "torc.sim.actuation",
    "torc.sim.portraits",
    "torc.sim.robot",
    "torc.sim.simulated_world",
    "torc.sim.stepping",
    "torc.specs.conditions",
    "torc.specs.spec_files",
    "torc.task_planning.dg_select",
    "torc.task_planning.protocol",
    "torc.task_planning.random_choice",
    "torc.task_planning.relations",
    "torc.testing.conformance",
    "torc.vlm.answers",
    "torc.vlm.cache",
    "torc.vlm.failures",
    "torc.vlm.numerals",
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
}
"""Modules of the core that satellites import: the shorter this list, the better."""
HELPERS = {
    "fake_bench",
    "fake_robot",
    "fake_trial",
    "full_geometry",
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
    folders = [
        f for f in (PACKAGES / satellite.package / "src" / satellite.module).glob("parts/*") if f.is_dir()
    ]
    parts = {f"torc.{f.name}": {p.stem.replace("_", "-") for p in f.glob("[!_]*.py")} for f in folders}
    assert parts == {group: set(names) for group, names in satellite.parts.items()}
    assert groups.get("torc.parts", {}) == ({satellite.package: f"{satellite.module}.parts"} if parts else {})
    extras = tomllib.loads((PACKAGES.parent / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    for extra in {satellite.extra, *(e for names in satellite.parts.values() for e in names.values())}:
        assert any(wanted.startswith(satellite.package) for wanted in extras[extra])
