"""Imports point only to earlier packages and never in circles; nothing outside `testing` imports it; heavy extras
stay optional."""

import ast
import subprocess
import sys
from collections import Counter
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import torc

ORDER = [
    "errors",
    "satellites",
    "io",
    "registry",
    "processes",
    "parallel",
    "interrupts",
    "records",
    "geometry",
    "robots",
    "objects",
    "workspace",
    "problems",
    "perception",
    "occlusion",
    "collision",
    "grasping",
    "motion",
    "task_planning",
    "drawing",
    "vlm",
    "specs",
    "pipeline",
    "cameras",
    "brain",
    # Nothing that decides knows the simulation.
    "sim",
    "episode",
    "trials",
    "oracle",
    "gym_env",
    "exports",
    "generation",
    "benchmark",
    "verbs",
    "protocols",
    "web",
    # A folder for each kind of part; found by name, imported by nobody.
    "parts",
    "cli",
]
ROOT = Path(torc.__file__).parent
TYPES_ALONE = ROOT / "registry" / "context.py"
"""Its imports for type checkers may point down: it names the types of everything that parts are given."""
MODULES = sorted(p for p in ROOT.rglob("*.py") if "testing" not in p.parts)
CHECKOUT = Path(__file__).parents[1]
SATELLITES = sorted((CHECKOUT / "packages").glob("*/src/*"))
EVERYWHERE = [*ROOT.rglob("*.py"), *(p for satellite in SATELLITES for p in satellite.rglob("*.py"))]
TESTS = [p for p in (CHECKOUT / "tests", *(CHECKOUT / "packages").glob("*/tests")) for p in p.rglob("*.py")]


@cache
def _imported(path):
    names = []
    tree = ast.parse(path.read_text())
    if path == TYPES_ALONE:
        tree.body = [n for n in tree.body if not (isinstance(n, ast.If) and n.test.id == "TYPE_CHECKING")]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module == "torc":
            names += [f"torc.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names.append("." * node.level + (node.module or ""))
    return names


def _package(path):
    """The package of torc in which a module lies; the satellite, for those of satellites."""
    if path.is_relative_to(ROOT):
        return path.relative_to(ROOT).parts[0].removesuffix(".py")
    return next(satellite.name for satellite in SATELLITES if path.is_relative_to(satellite))


def test_no_two_test_files_have_the_same_name():
    """pytest imports them by their file names alone."""
    names = Counter(p.name for p in TESTS if p.name != "conftest.py")
    assert [name for name, count in names.items() if count > 1] == []


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


def test_nothing_installed_imports_what_is_not():
    roots = {name.split(".")[0] for path in EVERYWHERE for name in _imported(path)}
    assert not roots & {"benchmarks", "tests", "tools"}


def test_no_modules_import_each_other_in_a_circle():
    """Not even within functions, where Python would let them."""
    paths = {".".join(p.relative_to(ROOT.parent).with_suffix("").parts): p for p in MODULES}
    for satellite in SATELLITES:
        for path in satellite.rglob("*.py"):
            paths[".".join(path.relative_to(satellite.parent).with_suffix("").parts)] = path
    graph = {}
    for name, path in paths.items():
        if path.name != "__init__.py":
            graph[name] = {found for found in _imported(path) if found in paths} - {name}
    assert len(list(TopologicalSorter(graph).static_order())) >= len(graph)


@pytest.mark.parametrize(
    ("library", "package"),
    [
        ("sklearn", ""),
        ("matplotlib", "benchmark"),
        ("pebble", "benchmark"),
        ("ray", "benchmark"),
        ("networkx", ""),
        ("coal", ""),
        ("trimesh", "objects"),
        ("coacd", "objects"),
        ("fast_simplification", "objects"),
        ("starlette", "web"),
        ("uvicorn", "web"),
        ("gymnasium", "gym_env"),
        ("pyarrow", "benchmark exports torc_next_object"),
        ("inspect_ai", "torc_next_object"),
        ("datasets", "torc_next_object"),
        ("vlmeval", "torc_next_object"),
        ("anyio", "torc_next_object"),
        ("pyrealsense2", "torc_lab"),
        ("pyzed", "torc_lab"),
        ("websockets", "torc_lab"),
        ("pymodbus", "torc_lab"),
        ("rtde_control", "torc_lab"),
        ("rtde_receive", "torc_lab"),
        ("zmq", "torc_networks"),
        ("msgpack", "torc_networks"),
        ("torch", "torc_networks"),
        ("torchvision", "torc_networks"),
        ("transformers", "torc_networks"),
        ("onnx", ""),
    ],
)
def test_extras_are_imported_only_where_they_are_used(library, package):
    users = {_package(p) for p in EVERYWHERE if any(n.split(".")[0] == library for n in _imported(p))}
    assert users <= set(package.split())


@pytest.mark.parametrize(
    ("module", "libraries"),
    [
        ("torc", {"numpy", "mujoco", "numba", "torch", "transformers"}),
        ("torc.objects.importing", {"trimesh", "coacd", "fast_simplification"}),
        ("torc.benchmark.report.writing", {"matplotlib", "pyarrow"}),
    ],
)
def test_importing_a_module_needs_none_of_these_libraries(module, libraries):
    probe = f"import sys, {module}; print({libraries} & set(sys.modules))"
    out = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "set()"


def _functions():
    for path in EVERYWHERE:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                # numba types its kernels, and extensions of its own, by itself.
                kernel = any(
                    "njit" in ast.unparse(d) or "overload" in ast.unparse(d) for d in node.decorator_list
                )
                yield path.as_posix(), node, kernel


def test_only_compiled_kernels_have_no_types():
    for path, function, kernel in _functions():
        arguments = [
            a for a in [*function.args.args, *function.args.kwonlyargs] if a.arg not in ("self", "cls")
        ]
        typed = function.returns is not None or any(a.annotation for a in arguments)
        assert kernel or typed, f"{path}: {function.name}"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_no_module_binds_a_name_twice(path):
    """The second binding would change what the first one's users compute with."""
    bound = Counter()
    for node in ast.parse(path.read_text()).body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        bound.update(n.id for target in targets for n in ast.walk(target) if isinstance(n, ast.Name))
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            bound[node.name] += 1
    assert [name for name, count in bound.items() if count > 1] == []
