"""What the robot makes of a problem before the first pick: what it sees, and what it could grasp."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from torc.generation.config import Hiddenness, hiddenness_of
from torc.generation.grasps import ModelGrasping
from torc.generation.surroundings import Surroundings, surroundings
from torc.grasping.protocol import GraspPlanner
from torc.pipeline.building import System
from torc.pipeline.look import Pipeline
from torc.problems.made_for import NAME_KEY, SOURCE_KEY
from torc.problems.problem import Problem
from torc.problems.schema import Scalar
from torc.records import TARGET_ID, GraspSet, Observation, OcclusionVolume, SegmentedScene
from torc.robots.description import RobotDescription
from torc.robots.loading import load_robot
from torc.robots.names import DEFAULT_ROBOT
from torc.sim.rendering import CameraRenderer
from torc.sim.visibility import Visibility, measure_visibility
from torc.sim.world import build_world
from torc.workspace.description import Workspace


@dataclass(frozen=True)
class SceneView:
    """The first look at a scene, whichever of its objects is the target: the problem's own target is object 0 of the
    picture, and visibility is in the order of `problem.ordered()`."""

    problem: Problem
    observation: Observation
    visibility: Visibility

    def fraction(self, name: str) -> float:
        """Visible fraction of an object."""
        return float(self.visibility.fractions[self._ids[name]])

    def pixels(self, name: str) -> int:
        """Visible pixels of an object."""
        return int(self.visibility.pixels[self._ids[name]])

    def observation_for(self, target: str) -> Observation:
        """The picture with the labels it would have if that object were the target."""
        renumbered = [o.name for o in replace(self.problem, target=target).ordered()]
        labels = self.observation.label_image
        new_ids = np.arange(-128, 128, dtype=np.int16)
        for new_id, name in enumerate(renumbered):
            new_ids[self._ids[name] + 128] = new_id
        return replace(self.observation, label_image=None if labels is None else new_ids[labels + 128])

    @cached_property
    def _ids(self) -> dict[str, int]:
        return {o.name: i for i, o in enumerate(self.problem.ordered())}


def robot_facts(robot: RobotDescription) -> dict[str, Scalar]:
    """What the `origin` of a problem says of the robot that it was made for: nothing of the shipped one."""
    own = robot.source != load_robot(DEFAULT_ROBOT).source
    return {NAME_KEY: robot.name, SOURCE_KEY: robot.source} if own else {}


@dataclass(frozen=True)
class Inspector:
    """Looks at problems with the system that will have to solve them."""

    system: System

    @property
    def robot(self) -> RobotDescription:
        return self.system.robot

    @property
    def workspace(self) -> Workspace:
        return self.system.workspace

    @cached_property
    def grasping(self) -> ModelGrasping:
        """Which objects the robot can grasp at all."""
        return ModelGrasping(self.robot, self.workspace)

    def view(self, problem: Problem) -> SceneView:
        """The first look at a problem whose objects are at rest. By rays, so that it is the same on every machine."""
        world = build_world(problem, self.robot, self.workspace)
        mount = self.workspace.camera
        with CameraRenderer(world, mount, "rays") as renderer:
            view = renderer.render()
        observation = Observation(
            view.rgb,
            view.depth_m,
            mount.K,
            mount.T_world_camera,
            self.robot.arm.rest_qpos,
            world.time_s,
            view.label_image,
        )
        return SceneView(problem, observation, measure_visibility(world, mount, view.label_image))

    def hiddenness(self, view: SceneView, target: str) -> Hiddenness:
        """The group that the target belongs to."""
        return hiddenness_of(view.fraction(target), view.pixels(target))

    def graspable_at_first(self, view: SceneView, target: str, looks: int = 1) -> bool:
        """Whether the robot finds a valid grasp of the target with everything in place, even one that hardly holds, in
        one of some looks with other random candidates."""
        observation = view.observation_for(target)
        for seed in range(looks):
            look = self._eyes.look(observation, seed=seed)
            if look.context.report.has_valid_grasp(TARGET_ID):
                return True
            if look.context.scene.target_id is None:
                break
        return False

    def graspable_at_all(self, problem: Problem, name: str) -> bool:
        """Whether an object of the problem has a grasp with nothing else on the table."""
        placement = next(o for o in problem.objects if o.name == name)
        return self.grasping.graspable(placement.model, placement.T_world_object)

    def around(self, problem: Problem, target: str) -> Surroundings:
        """The objects around a target that the paper's pruning rule asks about."""
        return surroundings(problem, target, self.workspace.camera.T_world_camera)

    @cached_property
    def _eyes(self) -> Pipeline:
        pipeline = self.system.pipeline
        return replace(pipeline, grasp_planner=_TargetOnly(pipeline.grasp_planner), min_score=0.0)


@dataclass(frozen=True)
class _TargetOnly:
    """Plans the grasps of the target alone, the very ones that the planner would among those of all objects."""

    planner: GraspPlanner

    def plan(self, scene: SegmentedScene, volume: OcclusionVolume, rng: np.random.Generator) -> GraspSet:
        # To the planner an object of no pixels is an obstacle that is too small to grasp.
        objects = tuple(o if o.id == TARGET_ID else replace(o, pixel_count=0) for o in scene.objects)
        return self.planner.plan(replace(scene, objects=objects), volume, rng)
