"""Collecting trials: scene after scene, snapshot, candidates with features, sampled trials, shards.

Every scene is a function of (seed, number of the scene), so a collection that was interrupted goes on as if it
had not been, and any grasp can be looked at again.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console

from tools.grasp_model.dataset import (
    Cause,
    Policy,
    Trials,
    concatenate,
    save_scenes,
    save_shard,
    shard_ranges,
)
from tools.grasp_model.floating import FloatingGripper, TrialOutcome
from tools.grasp_model.floating_model import build_floating
from tools.grasp_model.sampling import SamplingConfig, choose_for_evaluation, choose_for_training
from tools.grasp_model.scenes import SceneConfig, make_scene, take_away
from tools.grasp_model.snapshot import Eyes, Snapshot, take_snapshot
from torc.objects.library import load_object
from torc.problems.problem import Problem
from torc.robots.description import RobotDescription
from torc.robots.loading import load_robot
from torc.workspace.description import Workspace
from torc.workspace.workspace_files import load_workspace

Choice = Callable[[Snapshot, int, np.random.Generator], list[tuple[int, Policy]]]
"""Which candidates of a snapshot are tried, and why: from the snapshot, the stage and a generator."""


@dataclass(frozen=True)
class CollectConfig:
    """How trials are collected.

    Attributes:
        scenes: what scenes are made of.
        sampling: which candidates are tried.
        stages: snapshots per scene at most; before each but the first, objects are taken away.
        taken_away: objects taken away before each later snapshot, at most.
        eyes: how often snapshots are seen with which depth and masks.
        shard_trials: a shard is written when at least this many trials have come together.
    """

    scenes: SceneConfig = field(default_factory=SceneConfig)
    sampling: SamplingConfig = field(default_factory=SamplingConfig)
    stages: int = 3
    taken_away: int = 4
    eyes: Mapping[Eyes, float] = field(
        default_factory=lambda: {
            Eyes.EXACT: 0.25,
            Eyes.NOISE: 0.15,
            Eyes.SGBM: 0.2,
            Eyes.OWN: 0.15,
            Eyes.OWN_SGBM: 0.25,
        }
    )
    shard_trials: int = 500


@dataclass(frozen=True)
class Bench:
    """What every scene needs."""

    robot: RobotDescription
    workspace: Workspace
    seed: int
    config: CollectConfig


def collect(out: Path, scenes: int, seed: int, config: CollectConfig | None = None) -> None:
    """Collect training trials of known kinds into shards; goes on after the last shard there."""
    config = CollectConfig() if config is None else config
    bench = Bench(load_robot(), load_workspace(), seed, config)

    def choose(snapshot: Snapshot, stage: int, rng: np.random.Generator) -> list[tuple[int, Policy]]:
        return choose_for_training(snapshot, stage, rng, config.sampling)

    _run_scenes(out, scenes, bench, lambda number: scene_trials(bench, number, choose, False))


def evaluate(out: Path, scenes: int, seed: int, model: Path, config: CollectConfig | None = None) -> None:
    """Try, per visible object of fresh scenes, the choice of each rule; every third scene with unseen kinds."""
    from torc.grasping.features import FEATURE_NAMES
    from torc.grasping.trees import load_trees

    config = CollectConfig(stages=1) if config is None else config
    bench = Bench(load_robot(), load_workspace(), seed, config)
    score = load_trees(model, FEATURE_NAMES)

    def choose(snapshot: Snapshot, stage: int, rng: np.random.Generator) -> list[tuple[int, Policy]]:
        return choose_for_evaluation(snapshot, score.score(snapshot.features), rng)

    _run_scenes(out, scenes, bench, lambda number: scene_trials(bench, number, choose, number % 3 == 2))


def scene_trials(
    bench: Bench, number: int, choose: Choice, unseen_kinds: bool
) -> tuple[list[Trials], dict[str, Problem]]:
    """All trials of one scene, a table per snapshot, and the scene at each; empty if it did not settle."""
    tables: list[Trials] = []
    scenes: dict[str, Problem] = {}
    for stage, problem in enumerate(scene_stages(bench, number, unseen_kinds)):
        snapshot = look(bench, problem, number, stage)
        tried = choose(snapshot, stage, _rng(bench, number, stage, _CHOICE))
        if tried:
            tables.append(_try_all(bench, problem, snapshot, tried, number, stage))
            scenes[f"{number}/{stage}"] = problem
    return tables, scenes


def scene_stages(bench: Bench, number: int, unseen_kinds: bool) -> Iterator[Problem]:
    """The settled scenes of one number: the first, then with objects taken away, the upper ones rather than others.

    They depend on nothing but the seed, the library and the physics, so that any snapshot can be taken again.
    """
    problem = make_scene(_rng(bench, number, 0, _SCENE), bench.workspace, unseen_kinds, bench.config.scenes)
    for stage in range(bench.config.stages):
        if stage > 0 and problem is not None:
            problem = _next_stage(problem, _rng(bench, number, stage, _SCENE), bench)
        if problem is None:
            return
        yield problem


def look(bench: Bench, problem: Problem, number: int, stage: int) -> Snapshot:
    """The snapshot of a stage of a scene."""
    shares = bench.config.eyes
    drawn = _rng(bench, number, stage, _EYES).choice(len(shares), p=list(shares.values()))
    rng = look_rng(bench.seed, number, stage)
    return take_snapshot(problem, bench.robot.gripper, bench.workspace, list(shares)[int(drawn)], rng)


def look_rng(seed: int, number: int, stage: int) -> np.random.Generator:
    """The stream of a snapshot: first its sensor noise, then what the generators of grasps draw."""
    return np.random.default_rng([seed, number, stage, _LOOK])


_SCENE, _EYES, _LOOK, _CHOICE = range(4)


def _rng(bench: Bench, number: int, stage: int, purpose: int) -> np.random.Generator:
    """A stream of its own for each purpose, so that a change in one leaves the others alone."""
    return np.random.default_rng([bench.seed, number, stage, purpose])


def _try_all(
    bench: Bench,
    problem: Problem,
    snapshot: Snapshot,
    tried: list[tuple[int, Policy]],
    number: int,
    stage: int,
) -> Trials:
    """Try the chosen candidates; one that several rules chose is tried once and listed for each."""
    gripper = FloatingGripper(build_floating(problem, bench.robot, bench.workspace))
    grasps, true_ids = snapshot.grasps, snapshot.true_ids
    # A mask that shows nothing is no object's; nothing can come of it.
    tried = [(i, policy) for i, policy in tried if true_ids[int(grasps.object_ids[i])] >= 0]
    outcome_of = {
        i: gripper.trial(
            true_ids[int(grasps.object_ids[i])], grasps.Ts_world_tcp[i], float(grasps.widths_m[i])
        )
        for i in sorted({i for i, _ in tried})
    }
    return _rows(problem, snapshot, tried, [outcome_of[i] for i, _ in tried], (bench.seed, number, stage))


def _rows(
    problem: Problem,
    snapshot: Snapshot,
    tried: list[tuple[int, Policy]],
    outcomes: list[TrialOutcome],
    place: tuple[int, int, int],
) -> Trials:
    """The table of one snapshot; `place` is seed, scene and stage."""
    grasps, index, n = snapshot.grasps, np.array([i for i, _ in tried]), len(tried)
    placements = problem.ordered()
    of = grasps.object_ids[index]
    models = {k: load_object(placements[snapshot.true_ids[int(k)]].model) for k in np.unique(of).tolist()}
    return Trials(
        features=snapshot.features[index],
        feature_names=snapshot.feature_names,
        delivered=np.array([o.delivered for o in outcomes]),
        cause=np.array([o.cause for o in outcomes], dtype=np.uint8),
        policy=np.array([p for _, p in tried], dtype=np.uint8),
        scene=np.full(n, place[1], np.int64),
        stage=np.full(n, place[2], np.uint8),
        seed=np.full(n, place[0], np.int64),
        object_id=of.astype(np.int16),
        kind=np.array([models[k].kind for k in of.tolist()], dtype=np.str_),
        structured=np.full(n, problem.category == "structured"),
        held_out=np.array([models[k].held_out for k in of.tolist()]),
        eyes=np.full(n, snapshot.eyes, np.uint8),
        valid=snapshot.valid[index],
        generator=grasps.generators[index],
        p_hand=snapshot.p_hand[index].astype(np.float32),
        T_world_tcp=grasps.Ts_world_tcp[index],
        width_m=grasps.widths_m[index].astype(np.float32),
        pixel_count=np.array([snapshot.scene.object(int(k)).pixel_count for k in of], dtype=np.int32),
        others_moved=np.array([len(o.others_moved) for o in outcomes], dtype=np.uint8),
        others_dropped=np.array([len(o.others_dropped) for o in outcomes], dtype=np.uint8),
    )


def _next_stage(problem: Problem, rng: np.random.Generator, bench: Bench) -> Problem | None:
    """The scene with some objects taken away, preferably upper ones; None when too few are left."""
    count = int(rng.integers(1, bench.config.taken_away + 1))
    placements = problem.ordered()
    if len(placements) - count < 2:
        return None
    heights = np.array([o.position[2] for o in placements]) + 0.04 * rng.standard_normal(len(placements))
    names = [placements[i].name for i in np.argsort(-heights)[:count]]
    return take_away(problem, names, bench.workspace)


def _run_scenes(
    out: Path, scenes: int, bench: Bench, run: Callable[[int], tuple[list[Trials], dict[str, Problem]]]
) -> None:
    """Scene after scene from where the shards in `out` end; a shard whenever enough trials have come together."""
    done = max((last + 1 for _, last, _ in shard_ranges(out)), default=0)
    console, first = Console(stderr=True, highlight=False, soft_wrap=True), done
    waiting: list[Trials] = []
    problems: dict[str, Problem] = {}
    for number in range(done, scenes):
        tables, stages = run(number)
        waiting += tables
        problems |= stages
        console.print(_summary(number, scenes, tables))
        if sum(len(t) for t in waiting) >= bench.config.shard_trials or (number == scenes - 1 and waiting):
            save_scenes(out, problems, first, number)
            path = save_shard(out, concatenate(waiting), first, number)
            console.print(f"wrote {path.name}")
            waiting, problems, first = [], {}, number + 1


def _summary(number: int, scenes: int, tables: list[Trials]) -> str:
    if not tables:
        return f"scene {number + 1}/{scenes}: did not settle or shows nothing to grasp"
    trials = concatenate(tables)
    counts = np.bincount(trials.cause, minlength=len(Cause))
    causes = ", ".join(f"{counts[c]} {c.name.lower().replace('_', ' ')}" for c in Cause if counts[c])
    category = "structured" if trials.structured[0] else "pile"
    return (
        f"scene {number + 1}/{scenes} ({category}, {len(tables)} snapshots): {len(trials)} trials, {causes}"
    )
