"""Turn one snapshot into a `PlanningContext` (paper: A Modular Pipeline, steps 1 and 2)."""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Int16

from torc.collision.collision_world import CollisionWorld, build_collision_world
from torc.errors import InputError
from torc.grasping.protocol import GraspPlanner, ask_grasp_planner
from torc.grasping.validity import evaluate_grasps, evaluate_grasps_without_robot
from torc.motion.config import MotionConfig
from torc.motion.executable import without_lines
from torc.occlusion.volume import FIXED_CAMERA, OcclusionConfig, update_volume
from torc.perception.checked_scenes import ask_depth, ask_perception
from torc.perception.noise import NoiseConfig, add_sensor_noise
from torc.perception.protocol import AsMeasured, Depth, Perception, Wanted
from torc.pipeline.better_bet import BetConfig, hold_back_unlikely, hold_back_worse_bets
from torc.pipeline.failures import FailedGrasp, FailureConfig, lower_scores, still_valid, veto, with_status
from torc.pipeline.state import EpisodeState, first_state, stage_rng
from torc.pipeline.touch import with_touched
from torc.records import (
    BACKGROUND,
    Capture,
    GraspReport,
    GraspSet,
    GraspStatus,
    Observation,
    OcclusionVolume,
    PlanningContext,
    SegmentedScene,
    as_capture,
)
from torc.registry.kinds import PERCEPTIONS
from torc.robots.description import RobotDescription
from torc.robots.gripper import GripperDescription
from torc.specs.conditions import DEFAULT_MIN_SCORE
from torc.workspace.description import Workspace

NOTHING_WANTED = Wanted("")


@dataclass
class Lap:
    """One pass through a stage; `seconds` is known once it is over."""

    seconds: float = 0.0


class StageClock:
    """Sums the wall seconds spent in named stages; no result depends on them."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[Lap]:
        """Count the time of the block, even if it raises."""
        start, lap = time.perf_counter(), Lap()
        try:
            yield lap
        finally:
            lap.seconds = time.perf_counter() - start
            self.add({name: lap.seconds})

    def add(self, seconds: Mapping[str, float]) -> None:
        """Add times that were measured elsewhere."""
        for name, value in seconds.items():
            self.seconds[name] = self.seconds.get(name, 0.0) + value


@dataclass(frozen=True)
class View:
    """What one snapshot shows, before anything random is drawn for grasps.

    `capture` is as measured. `ids_given`: perception was given the true labels. `seconds` are wall time by stage.
    """

    capture: Capture
    ids_given: bool
    scene: SegmentedScene
    volume: OcclusionVolume
    world: CollisionWorld
    seconds: dict[str, float]


@dataclass(frozen=True)
class Look:
    """The result of one look.

    Attributes:
        context: all that task planners receive.
        captures: one per camera, as measured, with the truth if their source knows it.
        ids_given: perception was given the true labels, so the context's ids are the true ones.
        world: for motion planning.
        seconds: wall time by stage.
    """

    context: PlanningContext
    captures: tuple[Capture, ...]
    ids_given: bool
    world: CollisionWorld
    seconds: dict[str, float]

    @property
    def truth(self) -> Int16[np.ndarray, "h w"] | None:
        """The first camera's true labels where perception numbers the objects itself; None if they are unknown."""
        return None if self.ids_given else self.captures[0].label_image


@dataclass(frozen=True)
class Pipeline:
    """The parts between camera and task planner; each can be exchanged.

    Attributes:
        robot: whose reach decides which grasps are valid; a GripperDescription alone checks only the gripper.
        noise: sensor noise to add to each snapshot, None for none.
        min_score: valid grasps that are less likely to deliver become UNLIKELY while any object has a better one. Every
            task planner chooses from what is left: RANDOM draws among fewer objects, and for DG-SELECT an object
            without a better grasp is not graspable. 0 follows the paper: then no grasp waits.
        bets: when a doubtful grasp waits until a neighbour is cleared; see torc.pipeline.better_bet.
        motion: settings of the motion planner: by these, the best valid grasps of an object have straight motions, as
            many as the motion planner tries (`max_grasps`); worse ones are not followed.
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
        seen: Observation | Capture,
        state: EpisodeState | None = None,
        *,
        wanted: Wanted = NOTHING_WANTED,
        seed: int = 0,
        picks_left: int = 1,
        labels: Mapping[int, int] | None = None,
    ) -> Look:
        """Perceive, update the occlusion volume, plan and check grasps.

        Args:
            seen: the snapshot; a capture if perception needs its labels.
            state: what earlier looks and picks left; None before the first look.
            wanted: the target, in words and pictures.
            seed: decides all random draws, with the number of picks so far.
            picks_left: attempts left, this one included.
            labels: the user's own label per object id, for the planner's reasons.

        Raises:
            PartError, GraspPlannerError: a part crashed, or what it returned cannot be used.
        """
        state = first_state(self.workspace.grid) if state is None else state
        view = self.view(seen, state, wanted=wanted, seed=seed)
        return self.look_at(view, state, wanted=wanted, seed=seed, picks_left=picks_left, labels=labels)

    def view(self, seen: Observation | Capture, state: EpisodeState, *, wanted: Wanted, seed: int) -> View:
        """Do the first half of `look`: perceive, and update the occlusion volume. Raises PartError."""
        clock = StageClock()
        with clock.stage("perceive"):
            capture = self.measured(as_capture(seen), stage_rng(seed, state.pick, "noise"))
            scene = ask_perception(self.perception, capture, wanted, state.scene)
        with clock.stage("occlusion"):
            volume = update_volume(state.volume, scene, self.occlusion)
            # A few pixels of a target that counts as hidden would reveal to a planner where it is.
            hidden = (scene.label_image >= 0) & ~np.isin(scene.label_image, scene.ids)
            label = np.where(hidden, np.int16(BACKGROUND), scene.label_image)
            scene = replace(scene, label_image=label)
        with clock.stage("collision world"):
            world = build_collision_world(volume, self.workspace)
        ids_given = PERCEPTIONS.traits(self.perception).needs_labels
        return View(capture, ids_given, scene, volume, world, clock.seconds)

    def look_at(
        self,
        view: View,
        state: EpisodeState,
        *,
        wanted: Wanted,
        seed: int,
        picks_left: int,
        labels: Mapping[int, int] | None = None,
    ) -> Look:
        """Do the second half of `look`: plan and check grasps. Raises GraspPlannerError.

        The view is unchanged, so that other seeds can draw from it, too.
        """
        scene, volume, clock = view.scene, view.volume, StageClock()
        history = tuple(outcome.as_felt for outcome in state.outcomes)
        with clock.stage("grasps"):
            failed = still_valid(state.failed, scene, self.failures)
            felt = with_touched(scene, failed)
            grasps = ask_grasp_planner(
                self.grasp_planner, felt, volume, stage_rng(seed, state.pick, "grasps")
            )
            grasps = lower_scores(grasps, failed, history, self.failures)
        with clock.stage("validity"):
            report = self.evaluate(grasps, scene, volume, view.world, failed)
            report = hold_back_unlikely(report, grasps, self.min_score)
            if self.min_score > 0:
                report = hold_back_worse_bets(report, grasps, scene.target_id, picks_left, self.bets)
        gripper = self.robot.gripper if isinstance(self.robot, RobotDescription) else self.robot
        context = PlanningContext(
            scene=scene,
            volume=volume,
            grasps=grasps,
            report=report,
            target_description=wanted.description,
            history=history,
            picks_left=picks_left,
            labels=tuple((labels or {}).items()),
            target_size_m=wanted.size_m,
            hand=gripper.hand,
        )
        return Look(context, (view.capture,), view.ids_given, view.world, view.seconds | clock.seconds)

    def measured(self, capture: Capture, rng: np.random.Generator) -> Capture:
        """Return a snapshot with this pipeline's depth, after adding its noise if any."""
        if self.noise is not None:
            capture = add_sensor_noise(capture, self.noise, rng)
        return replace(capture, observation=ask_depth(self.depth, capture.observation))

    def evaluate(
        self,
        grasps: GraspSet,
        scene: SegmentedScene,
        volume: OcclusionVolume,
        world: CollisionWorld,
        failed: tuple[FailedGrasp, ...] = (),
    ) -> GraspReport:
        """Return which grasps the robot can carry out, and what blocks the others, whatever their probability.

        Grasps like one of `failed` without a motion are vetoed. Straight ways are followed for as many grasps of an
        object as the motion planner tries.
        """
        if not isinstance(self.robot, RobotDescription):
            report = evaluate_grasps_without_robot(grasps, scene, world, self.robot)
            return veto(report, grasps, failed, self.failures)
        report = evaluate_grasps(grasps, scene, world, self.robot)
        report = veto(report, grasps, failed, self.failures)
        support_z_m = self.workspace.support_z_m
        stuck = without_lines(grasps, report, scene, volume, world, self.robot, support_z_m, self.motion)
        return with_status(report, grasps, np.where(stuck, np.uint8(GraspStatus.NO_LINE), report.status))
