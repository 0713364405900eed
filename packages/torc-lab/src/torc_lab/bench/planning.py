"""Which trials a comparison on a real robot has, and in which order."""

import zlib
from collections.abc import Sequence

import numpy as np

import torc
from torc import InputError
from torc.benchmark.rows import REAL
from torc.benchmark.spec import BenchPlanner, BenchProblem, BenchSpec, find_around, make_spec
from torc.pipeline.planners import refuse_simulated
from torc_lab.lab_file import Lab
from torc_lab.scenes.scene import Scene


def plan_lab_bench(
    lab: Lab, scenes: Sequence[Scene], planners: Sequence[BenchPlanner], repeats: int, order_seed: int = 0
) -> BenchSpec:
    """Every planner in every scene, several times, scene by scene. In a scene every round has each planner once, in an
    order that `order_seed`, the scene and the round decide: neither the light nor who lays out gets used to one.

    The repeat is the seed of the trial. Raises InputError: two scenes of one name, planners that know the simulation,
    or nothing to play.
    """
    names = [scene.name for scene in scenes]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError(
            f"More than one scene is called {', '.join(twice)}: rename a directory and store it again."
        )
    if repeats < 1:
        raise InputError("--repeats must be at least 1.")
    for planner in planners:
        refuse_simulated(planner.spec.name)
        if planner.spec.vlm is not None and planner.spec.vlm.simulated:
            raise InputError("A simulated model answers by the simulator's truth, which no real scene has.")
    problems = [BenchProblem(scene.problem, REAL, scene.digest, shipped=False) for scene in scenes]
    spec = make_spec(problems, planners, range(repeats), find_around(lab.conditions), torc.__version__)
    by_cell = {trial.cell: trial for trial in spec.trials}
    labels = [planner.label for planner in planners]
    ordered = [
        by_cell[labels[k], problem.name, round_]
        for problem in problems
        for round_ in range(repeats)
        for k in _order(len(labels), order_seed, problem.name, round_)
    ]
    return BenchSpec(spec.around, tuple(ordered))


def _order(count: int, seed: int, name: str, round_: int) -> list[int]:
    return np.random.default_rng([seed, zlib.crc32(name.encode()), round_]).permutation(count).tolist()
