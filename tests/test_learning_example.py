"""The example that learns: its gradient is one, and it plays the real environment."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

SCRIPT = Path(__file__).parents[1] / "examples" / "learn_next_object.py"


@pytest.fixture
def example():
    spec = importlib.util.spec_from_file_location("learn_next_object", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_gradient_is_that_of_the_log_probability(example, rng):
    rows, mask = rng.normal(size=(6, 4)), np.array([1, 0, 1, 1, 0, 1])
    policy = example.LinearPolicy(4)
    policy.weights = rng.normal(size=4)
    found, step = policy.gradient(rows, mask, 3), 1e-6
    for i in range(4):
        ends = []
        for sign in (1, -1):
            moved = example.LinearPolicy(4)
            moved.weights = policy.weights + sign * step * np.eye(4)[i]
            ends.append(np.log(moved.probabilities(rows, mask)[3]))
        assert found[i] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-6)
    assert policy.probabilities(rows, mask)[mask == 0].max() == 0
    assert policy.probabilities(rows, np.zeros(6)).min() > 0


@pytest.mark.slow
def test_it_plays_and_prints_its_curve():
    command = [
        sys.executable,
        str(SCRIPT),
        "--problems",
        "structured-04",
        "--episodes",
        "2",
        "--report-every",
        "1",
    ]
    out = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert [line.split()[:2] for line in out[:2]] == [["episode", "1"], ["episode", "2"]]
    assert out[-1].startswith("weights:")
