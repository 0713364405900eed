"""The examples do what they say."""

import importlib.util
from pathlib import Path

from torc.testing.planner_conformance import check_planner

EXAMPLES = Path(__file__).parents[1] / "examples"


def _load(name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_example_planner_keeps_to_the_rules():
    check_planner(_load("nearest_planner").Nearest)
