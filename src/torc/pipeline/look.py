"""From one snapshot to a `PlanningContext` (paper: A Modular Pipeline, steps 1 and 2)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from torc.collision.world import CollisionWorld, build_collision_world
from torc.errors import InputError
from torc.grasping.asking import ask_grasp_planner
from torc.grasping.protocol import GraspPlanner
from torc.grasping.validity import evaluate_grasps, evaluate_grasps_without_robot
from torc.motion.config import MotionConfig
from torc.motion.executable import without_lines
from torc.occlusion.volume import FIXED_CAMERA, OcclusionConfig, update_volume
from torc.perception.asking import ask_depth, ask_perception
from torc.perception.depth import AsMeasured
from torc.perception.noise import NoiseConfig, add_sensor_noise
from torc.perception.protocol import Depth, Perception, Wanted
from torc.pipeline.better_bet import BetConfig, hold_back_worse_bets
from torc.pipeline.failures import FailureConfig, lower_scores, still_valid, veto
from torc.pipeline.report import hold_back_unlikely, with_status
from torc.pipeline.seeding import stage_rng
from torc.pipeline.state import EpisodeState, first_state
from torc.pipeline.timing import StageClock
from torc.pipeline.touch import with_touched
from torc.records import (
    BACKGROUND,
    GraspReport,
    GraspSet,
    GraspStatus,
    Observation,
    OcclusionVolume,
    PlanningContext,
    SegmentedScene,
)
from torc.robots.description import RobotDescription
from torc.robots.gripper import GripperDescription
from torc.specs.conditions import DEFAULT_MIN_SCORE
from torc.workspace.description import Workspace


@dataclass(frozen=True)
class Look:
    """What one snapshot tells.

    Attributes:
        context: what a task planner may see.
        observation: the snapshot as perception was given it, with the labels of objects that are not in sight, too.
        world: the collision world of this snapshot, for motion planning.
        seconds: wall time by stage.
    """

    context: PlanningContext
    observation: Observation
    world: CollisionWorld
    seconds: dict[str, float]


@dataclass(frozen=True)
class Pipeline:
    """The parts between camera and task planner; each can be exchanged.

    Attributes:
        robot: whose reach decides which grasps are valid; a GripperDescription alone checks only the gripper.
        noise: sensor noise to add to each snapshot, None for none.
        min_score: valid grasps that are less likely to deliver become UNLIKELY while any object has a better one. Every
            task planner chooses from what is left: RANDOM draws among fewer objects, and DG-SELECT takes an object
            without a better grasp for one that is not graspable. 0 keeps to the paper: then no grasp waits.
        bets: when a doubtful grasp waits until a neighbour is cleared; see torc.pipeline.better_bet.
        motion: settings of the motion planner: a valid grasp has straight motions by these.
    """

    perception: Perception
    grasp_planner: GraspPlanner
    robot: RobotDescription | GripperDescription
    workspace: Workspace
    noise: NoiseConfig | None = None
    occlusion: OcclusionConfig = FIXED_CAMERA
    failures: FailureConfig = field(default_factory=FailureConfig)
    min_score: float = DEFAULT_MIN_SCORE
    bets: BetConfig = field(default_factory=BetConfig)
    motion: MotionConfig = field(default_factory=MotionConfig)
    depth: Depth = field(default_factory=AsMeasured)

    def __post_init__(self) -> None:
        if not 0.0 <= self.min_score <= 1.0:
            raise InputError(f"The least score is {self.min_score}; it is a probability, from 0 to 1.")

    def look(
        self,
        observation: Observation,
        state: EpisodeState | None = None,
        *,
        target_description: str = "",
        seed: int = 0,
        picks_left: int = 1,
        labels: Mapping[int, int] | None = None,
    ) -> Look:
        """Perceive, update the occlusion volume, plan and check grasps.

        Args:
            state: what is known from earlier looks and picks; nothing if not given.
            seed: with the number of picks so far it decides all random draws.
            picks_left: attempts left, this one included.
            labels: the user's own label per object id, for the planner's reasons; none in simulation.

        Raises:
            PartError, GraspPlannerError: a part crashed, or what it returned cannot be used.
        """
        state = first_state(self.workspace.grid) if state is None else state
        history = tuple(outcome.as_felt for outcome in state.outcomes)
        pick, clock = state.pick, StageClock()
        with clock.stage("perceive"):
            if self.noise is not None:
                observation = add_sensor_noise(observation, self.noise, stage_rng(seed, pick, "noise"))
            observation = ask_depth(self.depth, observation)
            scene = ask_perception(self.perception, observation, Wanted(target_description), state.scene)
        with clock.stage("occlusion"):
            volume = update_volume(state.volume, scene, self.occlusion)
            scene = _reported(scene)
        with clock.stage("collision world"):
            world = build_collision_world(volume, self.workspace)
        with clock.stage("grasps"):
            failed = still_valid(state.failed, scene, self.failures)
            felt = with_touched(scene, failed)
            grasps = ask_grasp_planner(self.grasp_planner, felt, volume, stage_rng(seed, pick, "grasps"))
            grasps = lower_scores(grasps, failed, history, self.failures)
        with clock.stage("validity"):
            report = veto(self.evaluate(grasps, scene, volume, world), grasps, failed, self.failures)
            report = hold_back_unlikely(report, grasps, self.min_score)
            if self.min_score > 0:
                report = hold_back_worse_bets(report, grasps, picks_left, self.bets)
        told = target_description, history, picks_left, tuple((labels or {}).items())
        return Look(PlanningContext(scene, volume, grasps, report, *told), observation, world, clock.seconds)

    def evaluate(
        self, grasps: GraspSet, scene: SegmentedScene, volume: OcclusionVolume, world: CollisionWorld
    ) -> GraspReport:
        """Which grasps the robot can carry out, and what is in the way of the others; whatever their probability."""
        if not isinstance(self.robot, RobotDescription):
            return evaluate_grasps_without_robot(grasps, scene, world, self.robot)
        report = evaluate_grasps(grasps, scene, world, self.robot)
        support_z_m = self.workspace.support_z_m
        stuck = without_lines(grasps, report, scene, volume, world, self.robot, support_z_m, self.motion)
        return with_status(report, grasps, np.where(stuck, np.uint8(GraspStatus.NO_LINE), report.status))


def _reported(scene: SegmentedScene) -> SegmentedScene:
    """The scene with the labels of reported objects alone: others are perception's own, or a simulator's truth.

    A few pixels of a target that counts as hidden would otherwise tell a task planner, or a grasp planner, where it is.
    """
    hidden = (scene.label_image >= 0) & ~np.isin(scene.label_image, scene.ids)
    label = np.where(hidden, np.int16(BACKGROUND), scene.label_image)
    observation = scene.observation
    if observation.label_image is not None:
        observation = replace(observation, label_image=label)
    return replace(scene, observation=observation, label_image=label)
