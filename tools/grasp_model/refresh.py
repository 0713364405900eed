"""New features for old trials: a grasp succeeds or fails whatever is measured of it, and trials are the dear part."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console

from tools.grasp_model.collect import look_rng
from tools.grasp_model.dataset import (
    Trials,
    concatenate,
    load_scenes,
    load_shard,
    save_scenes,
    save_shard,
    shard_ranges,
)
from tools.grasp_model.hand_score import HandScore
from tools.grasp_model.snapshot import Eyes, perceive
from torc.grasping.candidate_checks import Fault, check_candidates
from torc.grasping.clouds import ObjectCloud, SceneClouds, build_clouds
from torc.grasping.config import GraspConfig
from torc.grasping.features import FEATURE_NAMES, compute_features
from torc.grasping.generators.common import RawCandidates
from torc.grasping.hand import HandGeometry, hand_geometry
from torc.problems.problem import Problem
from torc.records import OcclusionVolume
from torc.robots.loading import load_robot
from torc.workspace.description import Workspace
from torc.workspace.workspace_files import load_workspace

_SLACK_M = 1e-5


def refresh(data: Path, out: Path) -> None:
    """Look at the scenes of all shards again and write the trials with the features of today.

    Trials whose grasp today's checks would reject because of its own object or the table are left out. Goes on
    where it was interrupted.
    """
    hand, workspace, console = (
        hand_geometry(load_robot().gripper),
        load_workspace(),
        Console(stderr=True, soft_wrap=True),
    )
    done = {(first, last) for first, last, _ in shard_ranges(out)}
    for first, last, path in shard_ranges(data):
        if (first, last) in done:
            continue
        trials, scenes = load_shard(path), load_scenes(path)
        parts = []
        for key, problem in scenes.items():
            number, stage = (int(part) for part in key.split("/"))
            rows = (trials.scene == number) & (trials.stage == stage)
            parts.append(refreshed(trials[rows], problem, hand, workspace))
        save_scenes(out, scenes, first, last)
        fresh = concatenate(parts)
        save_shard(out, fresh, first, last)
        console.print(f"{path.name}: {len(fresh)} of {len(trials)} trials")


def refreshed(trials: Trials, problem: Problem, hand: HandGeometry, workspace: Workspace) -> Trials:
    """The trials of one snapshot with today's features, hand-written score and validity."""
    rng = look_rng(int(trials.seed[0]), int(trials.scene[0]), int(trials.stage[0]))
    scene, volume, _ = perceive(problem, workspace, Eyes(int(trials.eyes[0])), rng)
    clouds = build_clouds(scene, volume, workspace.support_z_m, GraspConfig().clouds)
    features = np.zeros((len(trials), len(FEATURE_NAMES)), np.float32)
    valid, sound = np.zeros(len(trials), bool), np.zeros(len(trials), bool)
    for cloud in clouds.objects:
        rows = np.flatnonzero(trials.object_id == cloud.id)
        if len(rows):
            features[rows], valid[rows], sound[rows] = _measure(
                trials[rows], cloud, clouds, volume, hand, workspace
            )
    p_hand = HandScore().score(features).astype(np.float32)
    renewed = replace(trials, features=features, feature_names=FEATURE_NAMES, p_hand=p_hand, valid=valid)
    return renewed[sound]


def _measure(
    trials: Trials,
    cloud: ObjectCloud,
    clouds: SceneClouds,
    volume: OcclusionVolume,
    hand: HandGeometry,
    workspace: Workspace,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Features, validity, and soundness as far as its own object goes, of the grasps of one object."""
    Ts, strict = trials.T_world_tcp.astype(float), GraspConfig().checks
    # Generators put fingertips exactly at their margin from the table: a rounding error must not reject them.
    checks = replace(
        strict, tip_margin_m=strict.tip_margin_m - _SLACK_M, table_margin_m=strict.table_margin_m - _SLACK_M
    )
    raw = RawCandidates(
        np.ascontiguousarray(Ts[:, :3, :3]), np.ascontiguousarray(Ts[:, :3, 3]), trials.width_m.astype(float)
    )
    z = workspace.support_z_m
    found = check_candidates(raw, cloud, clouds.cells, hand, z, checks)
    features = compute_features(
        raw, found.foreign, cloud, clouds.cells, hand, volume, z, clouds.camera_position
    )
    return features, ~found.blocked, found.fault == Fault.NONE
