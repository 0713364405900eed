"""What the grasp planner sees of a scene: rendered, perceived, candidates with features."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32

from tools.grasp_model.hand_score import HandScore
from torc.grasping.features import FEATURE_NAMES
from torc.grasping.planner import GeometricGraspPlanner
from torc.occlusion.volume import FIXED_CAMERA, FIXED_REAL_CAMERA, empty_volume, update_volume
from torc.perception.noise import add_sensor_noise, stereo_camera
from torc.perception.privileged import LabelPerception
from torc.perception.segmentation import REAL_CAMERA
from torc.problems.problem import Problem
from torc.records import GraspSet, Observation, OcclusionVolume, SegmentedScene
from torc.robots.gripper import GripperDescription
from torc.sim.rendering import CameraRenderer
from torc.sim.world import build_world
from torc.workspace.description import CameraMount, Workspace


@dataclass(frozen=True)
class Snapshot:
    """One look at a scene.

    Attributes:
        scene: what was perceived.
        volume: occlusion volume after this one look.
        grasps: candidates that are sound as far as their own object and the table go.
        features, feature_names: inputs of the score.
        p_hand: the hand-written score.
        valid: the gripper touches no point of another object.
        noisy: whether sensor noise was added.
    """

    scene: SegmentedScene
    volume: OcclusionVolume
    grasps: GraspSet
    features: Float32[np.ndarray, "n f"]
    feature_names: tuple[str, ...]
    p_hand: Float[np.ndarray, "n"]
    valid: Bool[np.ndarray, "n"]
    noisy: bool


def take_snapshot(
    problem: Problem, gripper: GripperDescription, workspace: Workspace, noisy: bool, rng: np.random.Generator
) -> Snapshot:
    """Render a settled scene without the arm, perceive it and propose grasps."""
    scene, volume = perceive(problem, workspace, noisy, rng)
    found = GeometricGraspPlanner(gripper, workspace.support_z_m, scorer=HandScore()).candidates(
        scene, volume, rng
    )
    return Snapshot(
        scene, volume, found.grasps, found.features, FEATURE_NAMES, found.grasps.scores, ~found.blocked, noisy
    )


def perceive(
    problem: Problem, workspace: Workspace, noisy: bool, rng: np.random.Generator
) -> tuple[SegmentedScene, OcclusionVolume]:
    """One look at a settled scene without the arm, with or without sensor noise."""
    with CameraRenderer(build_world(problem, None, workspace), workspace.camera) as renderer:
        observation = observe(renderer, workspace.camera)
    if noisy:
        observation = add_sensor_noise(observation, stereo_camera(), rng)
    return interpret(observation, workspace, noisy)


def interpret(
    observation: Observation, workspace: Workspace, noisy: bool = False
) -> tuple[SegmentedScene, OcclusionVolume]:
    """The objects in a first look at a scene, and what it left unseen; as a trial sees them with or without noise."""
    scene = LabelPerception(REAL_CAMERA if noisy else None).perceive(observation)
    occlusion = FIXED_REAL_CAMERA if noisy else FIXED_CAMERA
    return scene, update_volume(empty_volume(workspace.grid), scene, occlusion)


def observe(renderer: CameraRenderer, mount: CameraMount) -> Observation:
    """One clean RGB-D frame with labels of the renderer's world, through the mount that it was made with."""
    view = renderer.render()
    return Observation(
        view.rgb, view.depth_m, mount.K, mount.T_world_camera, np.zeros(0), 0.0, view.label_image
    )
