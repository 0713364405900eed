"""What the grasp planner sees of a scene: rendered, perceived, candidates with features."""

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from jaxtyping import Bool, Float, Float32

from tools.grasp_model.hand_score import HandScore
from torc.episode.identity import shown_by
from torc.grasping.features import FEATURE_NAMES
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.occlusion.volume import empty_volume, update_volume
from torc.perception.checked_scenes import ask_perception
from torc.perception.noise import add_sensor_noise
from torc.perception.protocol import Wanted
from torc.pipeline.building import build_pipeline
from torc.pipeline.look import Pipeline
from torc.problems.problem import Problem
from torc.records import Capture, GraspSet, Observation, OcclusionVolume, SegmentedScene
from torc.robots.gripper import GripperDescription
from torc.robots.loading import load_robot
from torc.sim.rendering import CameraRenderer
from torc.sim.robot import SimulatedCamera
from torc.sim.simulated_world import build_world
from torc.sim.stereo_camera import StereoRig
from torc.specs.conditions import PipelineSpec
from torc.workspace.description import CameraMount, Workspace


class Eyes(IntEnum):
    """Who sees: which depth and whose masks."""

    EXACT = 0
    NOISE = 1
    """The made-up noise of `--noise`."""
    SGBM = 2
    """Exact masks, depth by semi-global matching."""
    OWN = 3
    """torc's own masks, exact depth."""
    OWN_SGBM = 4
    """torc's own masks, depth by semi-global matching."""

    @property
    def spec(self) -> PipelineSpec:
        """The stages that these are."""
        return PipelineSpec(
            depth="sgbm" if self in (Eyes.SGBM, Eyes.OWN_SGBM) else "as-measured",
            perception="embedded" if self in (Eyes.OWN, Eyes.OWN_SGBM) else "labels",
        )


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
        true_ids: what each object of the scene really is.
        eyes: who saw it.
    """

    scene: SegmentedScene
    volume: OcclusionVolume
    grasps: GraspSet
    features: Float32[np.ndarray, "n f"]
    feature_names: tuple[str, ...]
    p_hand: Float[np.ndarray, "n"]
    valid: Bool[np.ndarray, "n"]
    true_ids: dict[int, int]
    eyes: Eyes


def take_snapshot(
    problem: Problem, gripper: GripperDescription, workspace: Workspace, eyes: Eyes, rng: np.random.Generator
) -> Snapshot:
    """Render a settled scene without the arm, perceive it and propose grasps."""
    scene, volume, true_ids = perceive(problem, workspace, eyes, rng)
    found = GeometricGraspPlanner(gripper, workspace.support_z_m, scorer=HandScore()).candidates(
        scene, volume, rng
    )
    return Snapshot(
        scene=scene,
        volume=volume,
        grasps=found.grasps,
        features=found.features,
        feature_names=FEATURE_NAMES,
        p_hand=found.grasps.scores,
        valid=~found.blocked,
        true_ids=true_ids,
        eyes=eyes,
    )


def perceive(
    problem: Problem, workspace: Workspace, eyes: Eyes, rng: np.random.Generator
) -> tuple[SegmentedScene, OcclusionVolume, dict[int, int]]:
    """One look at a settled scene without the arm, and what each object that is seen really is."""
    rig = StereoRig() if getattr(_seeing(eyes, workspace).depth, "needs_pair", False) else None
    with SimulatedCamera(build_world(problem, None, workspace), rig=rig) as camera:
        capture = camera.capture()
    scene, volume = interpret(capture, workspace, eyes, rng)
    truth = capture.label_image
    assert truth is not None  # a simulated camera knows it
    return scene, volume, shown_by(scene, truth)


def interpret(
    capture: Capture, workspace: Workspace, eyes: Eyes, rng: np.random.Generator
) -> tuple[SegmentedScene, OcclusionVolume]:
    """The objects in a first look at a scene, and what it left unseen, as a trial sees them."""
    seeing = _seeing(eyes, workspace)
    if seeing.noise is not None:
        capture = add_sensor_noise(capture, seeing.noise, rng)
    capture = replace(capture, observation=seeing.depth.measure(capture.observation))
    scene = ask_perception(seeing.perception, capture, Wanted(""), None)
    return scene, update_volume(empty_volume(workspace.grid), scene, seeing.occlusion)


def observe(renderer: CameraRenderer, mount: CameraMount) -> Capture:
    """One clean RGB-D frame with labels of the renderer's world, through the mount that it was made with."""
    view = renderer.render()
    observation = Observation(view.rgb, view.depth_m, mount.K, mount.T_world_camera, np.zeros(0), 0.0)
    return Capture(observation, view.label_image)


def _seeing(eyes: Eyes, workspace: Workspace) -> Pipeline:
    return build_pipeline(eyes.spec, load_robot().gripper, workspace, noisy=eyes is Eyes.NOISE)
