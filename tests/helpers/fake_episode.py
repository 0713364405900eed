"""Fakes for the episode loop: a table of analytic shapes, a robot that always succeeds (or fails as told), and
planners that do as they are told. Nothing here simulates physics."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from torc.episode.loop import Episode
from torc.episode.steps import EpisodeConfig
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.motion.protocol import PickRequest
from torc.perception.protocol import Perception, Wanted
from torc.perception.segmentation import LabelPerception, PerceptionConfig, segment
from torc.pipeline.building import System
from torc.pipeline.look import Pipeline
from torc.records import (
    BACKGROUND,
    TARGET_ID,
    Capture,
    Decision,
    FeltOutcome,
    Observation,
    PickOutcome,
    PickPlan,
    PickResult,
    PlanFailure,
    PlanningContext,
    PlanStage,
    SegmentedScene,
    Trajectory,
)
from torc.robots.description import RobotDescription
from torc.robots.protocols import HeldCheck
from torc.specs.conditions import Conditions
from torc.testing.synthetic import Shape, synthetic_capture
from torc.workspace.workspace_files import load_workspace


class FakeRobot:
    """Sees ray-cast shapes; a pick makes the shape vanish. `results` are those of the first picks; then all succeed."""

    def __init__(
        self, description: RobotDescription, shapes: Sequence[Shape], results: Sequence[PickOutcome] = ()
    ) -> None:
        self.description = description
        self.shapes = list(shapes)
        self.results = list(results)
        self.executed: list[PickPlan] = []
        self.true_id: int | None = None

    def capture(self) -> Capture:
        """Ray-cast what is left."""
        seen = synthetic_capture(self.shapes, stamp_s=float(len(self.executed)))
        return replace(seen, observation=replace(seen.observation, qpos=self.description.arm.rest_qpos))

    def aim_at(self, true_id: int | None) -> None:
        """Note what the next pick is meant for."""
        self.true_id = true_id

    def execute(self, plan: PickPlan, is_target: HeldCheck | None = None) -> PickOutcome:
        """Take the object away, or what the script says."""
        self.executed.append(plan)
        if len(self.executed) <= len(self.results):
            outcome = self.results[len(self.executed) - 1]
            if outcome.held_after_lift and is_target is not None:
                is_target(self.capture().observation, 0.04)
            return outcome
        true_id, self.true_id = self.true_id, None
        meant = plan.object_id if true_id is None else true_id
        self.shapes = [s for s in self.shapes if s.id != meant]
        believed = plan.is_target if is_target is None else is_target(self.capture().observation, 0.04)
        result, felt = _delivered(meant == TARGET_ID), _delivered(believed)
        told = FeltOutcome(felt, True, True)
        return PickOutcome(
            result, plan.object_id, meant, True, True, duration_s=5.0, felt=told, true_id=true_id
        )


def _delivered(target: bool) -> PickResult:
    return PickResult.RETRIEVED if target else PickResult.REMOVED


class RenamingEyes:
    """Sees the robot's shapes by ids of its own: `names` are those by the shapes' ids."""

    def __init__(self, robot: FakeRobot, names: Mapping[int, int]) -> None:
        self.robot, self.names = robot, names
        self.given: list[Observation] = []
        self.before: list[SegmentedScene | None] = []

    def perceive(
        self, observation: Observation, wanted: Wanted, before: SegmentedScene | None
    ) -> SegmentedScene:
        """The true masks, renamed."""
        self.given.append(observation)
        self.before.append(before)
        truth = synthetic_capture(self.robot.shapes).label_image
        assert truth is not None
        label = np.full(truth.shape, BACKGROUND, np.int16)
        for true_id, own_id in self.names.items():
            label[truth == true_id] = own_id
        return segment(observation, label, PerceptionConfig())


class RecognisingEyes(RenamingEyes):
    """The same; says of what is in the hand that it is the target with a probability by its own id."""

    def __init__(
        self, robot: FakeRobot, names: Mapping[int, int], in_hand: Mapping[int, float | None]
    ) -> None:
        super().__init__(robot, names)
        self.in_hand = in_hand

    def recognise(
        self,
        observation: Observation,
        mask: np.ndarray,
        wanted: Wanted,
        scene: SegmentedScene,
        object_id: int,
    ) -> float | None:
        """What was said beforehand."""
        assert mask.shape == observation.depth_m.shape
        assert isinstance(observation, Observation)
        return self.in_hand[object_id]


def fake_system(
    robot: FakeRobot,
    names: Mapping[int, int] | None = None,
    in_hand: Mapping[int, float | None] | None = None,
    impossible: Sequence[int] = (),
) -> System:
    """Real perception and grasps, and motions that stand still; with `names` eyes that have ids of their own, and with
    `in_hand` ones that recognise what is lifted.
    """
    workspace, gripper = load_workspace(), robot.description.gripper
    grasps = GeometricGraspPlanner(gripper, workspace.support_z_m)
    eyes: Perception = LabelPerception()
    if names is not None:
        eyes = RenamingEyes(robot, names) if in_hand is None else RecognisingEyes(robot, names, in_hand)
    pipeline = Pipeline(eyes, grasps, gripper, workspace)
    return System(Conditions(), robot.description, workspace, pipeline, FakeMotionPlanner(impossible))


class FakeMotionPlanner:
    """Plans nothing: returns motions that stand still, or a failure for the objects in `impossible`."""

    def __init__(self, impossible: Sequence[int] = ()) -> None:
        self.impossible = set(impossible)

    def plan_pick(self, request: PickRequest, rng: np.random.Generator) -> PickPlan | PlanFailure:
        """The object's best valid grasp, with motions of one second that stand still."""
        if request.object_id in self.impossible:
            return PlanFailure(PlanStage.FREE, "told to fail", 1)
        valid = [g for g in request.grasps.of(request.object_id) if request.report.status[g] == 0]
        g = int(valid[0])
        here = np.asarray(request.qpos_start, dtype=float)
        still = Trajectory(np.array([0.0, 1.0]), np.tile(here, (2, 1)), np.zeros((2, len(here))))
        pose, width = request.grasps.Ts_world_tcp[g], float(request.grasps.widths_m[g])
        return PickPlan(request.object_id, g, pose, width, still, still, still, still, still, 1)


class ScriptedPlanner:
    """Names the objects of a list in turn, then nothing; takes those of `targets` for the target."""

    name = "scripted"

    def __init__(self, choices: Sequence[int | None], targets: Sequence[int] = ()) -> None:
        self.choices, self.targets = list(choices), targets

    def decide(self, context: PlanningContext, rng: np.random.Generator) -> Decision:
        """The choice for this pick."""
        pick = len(context.history)
        choice = self.choices[pick] if pick < len(self.choices) else None
        return Decision(choice, f"told to pick {choice}", is_target=choice in self.targets)


class FakeSimulation:
    """Begins episodes on a table of analytic shapes, whatever the problem; see `torc.gym_env.env.EpisodeSimulation`.

    `results` are those of the executed picks per episode; success where a list ends, or where there is none.
    """

    def __init__(
        self,
        description: RobotDescription,
        shapes: Sequence[Shape],
        results: Sequence[Sequence[PickOutcome]] = (),
    ) -> None:
        self.description, self.shapes, self.results = description, shapes, list(results)
        self.begun: list[tuple[str, EpisodeConfig]] = []

    def begin(self, problem: str, config: EpisodeConfig) -> Episode:
        """The table as it was at first."""
        results = self.results[len(self.begun)] if len(self.begun) < len(self.results) else ()
        self.begun.append((problem, config))
        robot = FakeRobot(self.description, self.shapes, results)
        return Episode(robot, fake_system(robot), Wanted("the small box"), config)

    def close(self) -> None:
        """Holds nothing."""
