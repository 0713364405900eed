"""Imports point only to earlier packages; nothing outside `testing` imports fakes; heavy extras stay optional."""

import ast
from pathlib import Path

import pytest

import torc

ORDER = [
    "errors",
    "records",
    "geometry",
    "scenes",
    "robots",
    "sim",
    "perception",
    "occlusion",
    "collision",
    "grasping",
    "motion",
    "pipeline",
    "task_planning",
    "brain",
    "episode",
    "cli",
]
ROOT = Path(torc.__file__).parent
MODULES = sorted(p for p in ROOT.rglob("*.py") if "testing" not in p.parts)


def _imported(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            if node.module == "torc":
                yield from (f"torc.{alias.name}" for alias in node.names)
            else:
                yield "." * node.level + (node.module or "")


def _package(path):
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def test_every_package_has_its_place():
    packages = {_package(p) for p in MODULES} - {"__init__"}
    assert packages == set(ORDER)


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_imports_point_to_earlier_packages(path):
    here = _package(path)
    for name in _imported(path):
        assert not name.startswith("."), "imports are absolute"
        parts = name.split(".")
        if parts[0] == "torc" and len(parts) > 1 and here != "__init__":
            assert parts[1] in ORDER, f"{name} is not for use at run time"
            assert ORDER.index(parts[1]) <= ORDER.index(here), f"{name} comes after {here}"


@pytest.mark.parametrize("library", ["sklearn", "matplotlib", "networkx", "coal"])
def test_extras_are_imported_only_where_they_are_used(library):
    users = {_package(p) for p in MODULES if any(n.split(".")[0] == library for n in _imported(p))}
    assert users <= {"grasping"}
