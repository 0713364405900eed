"""Core and satellites: the core imports none of them, and they use only its doors and nothing of each other."""

import ast
import importlib
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest

import torc
from tools import modules_page
from torc.satellites import SATELLITES

PACKAGES = Path(__file__).parents[1] / "packages"
CORE = Path(torc.__file__).parent


def _top_module(satellite):
    return satellite.package.replace("-", "_")


MODULES = {_top_module(s) for s in SATELLITES}
MOST_DOORS = 122
"""How many modules of the core other packages may import, beside torc and torc.protocols: it should only fall."""
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
        foreign = {m for m, _ in _imports(path) if m.split(".")[0] in MODULES - {_top_module(satellite)}}
        assert foreign == set(), path
        assert [name for m, name in _imports(path) if m.startswith("torc.") and name.startswith("_")] == [], (
            path
        )
        assert [m for m, name in _imports(path) if m.startswith("torc.") and not name] == [], path


def test_what_other_packages_use_of_the_core_is_on_its_page():
    assert modules_page.PAGE.read_text() == modules_page.page(), "run python -m tools.modules_page"
    used = modules_page.used_names()
    assert len(used) <= MOST_DOORS
    for module, names in used.items():
        found = vars(importlib.import_module(module))
        for name in names:
            what = found[name]
            ours = getattr(what, "__module__", "").startswith("torc") and callable(what)
            assert not ours or what.__doc__, f"{module}.{name}"


@pytest.mark.parametrize("satellite", SATELLITES, ids=lambda s: s.package)
def test_tests_of_a_satellite_borrow_only_these_helpers(satellite):
    for path in (PACKAGES / satellite.package / "tests").rglob("*.py"):
        names = {m for m, _ in _imports(path)}
        assert not {m.split(".")[0] for m in names} & (MODULES - {_top_module(satellite)}), path
        borrowed = {m.removeprefix("tests.helpers.") for m in names if m.startswith("tests.")}
        assert borrowed - HELPERS == set(), path


@pytest.mark.parametrize("satellite", SATELLITES, ids=lambda s: s.package)
def test_the_table_of_satellites_is_what_they_register(satellite):
    project = tomllib.loads((PACKAGES / satellite.package / "pyproject.toml").read_text())["project"]
    groups = project["entry-points"]
    assert project["name"] == satellite.package
    assert set(groups["torc.commands"]) == set(satellite.commands)
    folders = [
        f
        for f in (PACKAGES / satellite.package / "src" / _top_module(satellite)).glob("parts/*")
        if f.is_dir()
    ]
    parts = {f"torc.{f.name}": {p.stem.replace("_", "-") for p in f.glob("[!_]*.py")} for f in folders}
    assert parts == {group: set(names) for group, names in satellite.parts.items()}
    assert groups.get("torc.parts", {}) == (
        {satellite.package: f"{_top_module(satellite)}.parts"} if parts else {}
    )
    extras = tomllib.loads((PACKAGES.parent / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    for extra in {satellite.extra, *(e for names in satellite.parts.values() for e in names.values())}:
        assert any(wanted.startswith(satellite.package) for wanted in extras[extra])
