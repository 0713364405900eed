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


def test_an_object_that_blocks_what_blocks_the_target_is_waited_for(example):
    n = 64
    shapes = {"position": (n, 3), "edges": (n, n)}
    observation = {k: np.zeros(shapes.get(k, n), np.float32) for k in (*example.PER_OBJECT, "edges")}
    observation["target"][0] = 1
    for a, b, weight in ((0, 1, 0.75), (0, 2, 0.25), (1, 3, 0.5), (2, 3, 1.0)):
        observation["edges"][a, b] = weight
    direct, waits, out = example.features(observation)[:5, -3:].T
    assert direct == pytest.approx([0, 0.75, 0.25, 0, 0])
    assert waits == pytest.approx([0, 0.75, 0.25, 0.75 * 0.5 + 0.25, 0])
    assert out == pytest.approx([1, 0.5, 1, 0, 0])


def test_what_a_state_foretells_is_no_advantage(example, rng):
    baseline, states = example.Baseline(), list(rng.normal(size=(500, 3)))
    to_go = 10 * np.array(states) @ [1.0, -2.0, 0.5]
    assert baseline.advantages(states, to_go) == pytest.approx(np.zeros(500))
    baseline.add(states, to_go.tolist())
    assert baseline.advantages(states, to_go + 1) == pytest.approx(np.ones(500), abs=0.3)


@pytest.mark.slow
def test_it_plays_and_prints_its_curve(tmp_path):
    curve = tmp_path / "curve.svg"
    options = "--problems structured-04 --held-out structured-04 --episodes 2 --judge-every 1 --repeats 1"
    command = [sys.executable, str(SCRIPT), *options.split(), "--curve", str(curve)]
    out = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert [line.split()[0] for line in out] == ["RANDOM", "episode", "episode", "episode"]
    assert all("picks to retrieval" in line for line in out)
    assert "</svg>" in curve.read_text()
