"""The robot's view of a problem before the first pick: what it sees, and what it could grasp."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from torc.errors import UnknownNameError
from torc.generation.config import Hiddenness, hiddenness_of
from torc.generation.grasps import ModelGrasping, placed, surface_cloud
from torc.geometry.transforms import Pose
from torc.grasping.protocol import GraspPlanner
from torc.objects.library import load_object
from torc.occlusion.room import places_left
from torc.pipeline.building import System
from torc.pipeline.look import Pipeline
from torc.problems.problem import NAME_KEY, SOURCE_KEY, ObjectPlacement, Problem
from torc.problems.schema import Scalar
from torc.records import TARGET_ID, Capture, GraspSet, Observation, OcclusionVolume, SegmentedScene
from torc.robots.description import RobotDescription
from torc.robots.loading import load_robot
from torc.robots.names import DEFAULT_ROBOT, robot_names
from torc.sim.rendering import CameraRenderer
from torc.sim.settling import UNSEEN
from torc.sim.simulated_world import build_world
from torc.sim.visibility import Visibility, filled_voxels, measure_visibility
from torc.workspace.description import Workspace

BESIDE_M = 0.15
"""The paper's distance to the left or right."""


@dataclass(frozen=True)
class Surroundings:
    """Names of the objects around a target, in the problem's order; an object may be in several groups."""

    in_front: tuple[str, ...]
    beside: tuple[str, ...]
    taller: tuple[str, ...]

    @property
    def all(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys((*self.in_front, *self.beside, *self.taller)))


def surroundings(problem: Problem, target: str, T_world_camera: Pose) -> Surroundings:
    """Return the objects around a target, as the camera sees it. Raises UnknownNameError for an unknown target."""
    placements = {o.name: o for o in problem.objects}
    if target not in placements:
        raise UnknownNameError("object", target, list(placements))
    eye = T_world_camera[:2, 3]
    sight = np.asarray(placements[target].position[:2]) - eye
    sight = sight / max(float(np.linalg.norm(sight)), 1e-9)
    extents = {name: _extent(o, eye, sight) for name, o in placements.items()}
    own = extents.pop(target)
    in_front, beside, taller = [], [], []
    for name, extent in extents.items():
        # Distances between two objects' intervals; negative where they overlap.
        azimuth, along, across, _ = np.maximum(extent[:, 0] - own[:, 1], own[:, 0] - extent[:, 1])
        if extent[1, 0] < own[1, 0] and azimuth < 0:
            in_front.append(name)
        if along < 0 and across <= BESIDE_M:
            beside.append(name)
        if extent[3, 1] > own[3, 1] and np.hypot(max(along, 0.0), max(across, 0.0)) <= BESIDE_M:
            taller.append(name)
    return Surroundings(tuple(in_front), tuple(beside), tuple(taller))


def _extent(
    placement: ObjectPlacement, eye: Float[np.ndarray, "2"], sight: Float[np.ndarray, "2"]
) -> Float[np.ndarray, "4 2"]:
    """Return least and largest azimuth, distance along and across a line of sight, and height, seen from the camera."""
    points, _ = placed(*surface_cloud(load_object(placement.model)), placement.T_world_object)
    offset = points[:, :2] - eye
    along, across = offset @ sight, offset @ np.array([-sight[1], sight[0]])
    values = np.stack([np.arctan2(across, along), along, across, points[:, 2]])
    return np.stack([values.min(axis=1), values.max(axis=1)], axis=1)


@dataclass(frozen=True)
class SceneView:
    """The first look at a scene, whichever of its objects is the target.

    The problem's own target is object 0 of the picture, and visibility is in the order of `problem.ordered()`.
    """

    problem: Problem
    capture: Capture
    visibility: Visibility

    def fraction(self, name: str) -> float:
        """Return the visible fraction of an object."""
        return float(self.visibility.fractions[self._ids[name]])

    def pixels(self, name: str) -> int:
        """Return the visible pixels of an object."""
        return int(self.visibility.pixels[self._ids[name]])

    def capture_for(self, target: str) -> Capture:
        """Return the picture with its labels for that object as the target."""
        renumbered = [o.name for o in replace(self.problem, target=target).ordered()]
        new_ids = np.arange(-128, 128, dtype=np.int16)
        for new_id, name in enumerate(renumbered):
            new_ids[self._ids[name] + 128] = new_id
        label = self.capture.label_image
        assert label is not None  # a renderer knows it
        return replace(self.capture, label_image=new_ids[label + 128])

    @cached_property
    def _ids(self) -> dict[str, int]:
        return {o.name: i for i, o in enumerate(self.problem.ordered())}


def robot_facts(robot: RobotDescription) -> dict[str, Scalar]:
    """Return the robot's entries in a problem's `origin`: none for the default one, the name for shipped ones."""
    if robot.source == load_robot(DEFAULT_ROBOT).source:
        return {}
    shipped = robot.name in robot_names() and robot.source == load_robot(robot.name).source
    return {NAME_KEY: robot.name} if shipped else {NAME_KEY: robot.name, SOURCE_KEY: robot.source}


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
        """Answers which objects the robot can grasp at all."""
        return ModelGrasping(self.robot, self.workspace)

    def view(self, problem: Problem) -> SceneView:
        """Take the first look at a problem whose objects are at rest, by rays, so that it is equal on every machine."""
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
        )
        capture = Capture(observation, view.label_image)
        return SceneView(problem, capture, measure_visibility(world, mount, view.label_image))

    def hiddenness(self, view: SceneView, target: str) -> Hiddenness:
        """Return the group that the target belongs to."""
        return hiddenness_of(view.fraction(target), view.pixels(target))

    def graspable_at_first(self, view: SceneView, target: str, looks: int = 1) -> bool:
        """True if the robot finds a valid grasp of the target with everything in place, even one that hardly holds.

        One of `looks` looks, each with other random candidates, suffices.
        """
        capture = view.capture_for(target)
        for seed in range(looks):
            look = self._eyes.look(capture, seed=seed)
            if look.context.report.has_valid_grasp(TARGET_ID):
                return True
            if look.context.scene.target_id is None:
                break
        return False

    def places(self, view: SceneView) -> int:
        """Count the poses in which an absent target could be after the first look: see `places_left`."""
        world = build_world(view.problem, None, self.workspace, UNSEEN)
        volume = self._eyes.look(view.capture, seed=0).context.volume
        unseen = ~volume.seen & ~filled_voxels(world)
        return places_left(unseen, world.models[TARGET_ID], volume.grid.voxel_size_m)

    def graspable_at_all(self, problem: Problem, name: str) -> bool:
        """True if an object of the problem has a grasp with nothing else on the table."""
        placement = next(o for o in problem.objects if o.name == name)
        return self.grasping.graspable(placement.model, placement.T_world_object)

    def around(self, problem: Problem, target: str) -> Surroundings:
        """Return the objects around a target that the paper's pruning rule asks about."""
        return surroundings(problem, target, self.workspace.camera.T_world_camera)

    def difficulty(self, view: SceneView, target: str) -> "Difficulty":
        """Return the facts of a problem with that target; an absent one counts as hidden."""
        if view.problem.absent:
            return Difficulty(len(view.problem.objects), Hiddenness.HIDDEN, 0.0, 0, 0, 0)
        around = self.around(view.problem, target)
        return Difficulty(
            objects=len(view.problem.objects),
            hiddenness=self.hiddenness(view, target),
            visible_fraction=view.fraction(target),
            in_front=len(around.in_front),
            beside=len(around.beside),
            taller=len(around.taller),
        )

    @cached_property
    def _eyes(self) -> Pipeline:
        pipeline = self.system.pipeline
        return replace(pipeline, grasp_planner=_TargetOnly(pipeline.grasp_planner), min_score=0.0)


@dataclass(frozen=True)
class _TargetOnly:
    """Plans only the target's grasps, exactly those that the planner would plan among all objects."""

    planner: GraspPlanner

    def plan(self, scene: SegmentedScene, volume: OcclusionVolume, rng: np.random.Generator) -> GraspSet:
        # The planner takes an object without pixels for an obstacle that is too small to grasp.
        objects = tuple(o if o.id == TARGET_ID else replace(o, pixel_count=0) for o in scene.objects)
        return self.planner.plan(replace(scene, objects=objects), volume, rng)


@dataclass(frozen=True)
class Difficulty:
    """Facts of a problem.

    Attributes:
        visible_fraction: the target's visible pixels, as a share of those it would have alone.
        in_front, beside, taller: how many objects are around it, see `surroundings`.
    """

    objects: int
    hiddenness: Hiddenness
    visible_fraction: float
    in_front: int
    beside: int
    taller: int

    def facts(self) -> dict[str, Scalar]:
        return {
            "hiddenness": self.hiddenness.value,
            "visible_fraction": round(self.visible_fraction, 4),
            "in_front": self.in_front,
            "beside": self.beside,
            "taller": self.taller,
        }

    def words(self) -> str:
        seen = f"target {100 * self.visible_fraction:.0f} % in sight ({self.hiddenness.value})"
        around = f"{self.in_front} in front, {self.beside} beside, {self.taller} taller"
        return f"{self.objects} objects, {seen}, {around}"


def difficulty_of(problem: Problem, inspector: Inspector) -> Difficulty:
    """Return the facts of a problem: as its file states them, else measured."""
    return stated_difficulty(problem) or inspector.difficulty(inspector.view(problem), problem.target)


def stated_difficulty(problem: Problem) -> Difficulty | None:
    """Read `Difficulty.facts` from the problem's origin; None if they are missing, or of another target."""
    if problem.origin.get("target", problem.target) != problem.target:
        return None
    names = ("hiddenness", "visible_fraction", "in_front", "beside", "taller")
    try:
        group, fraction, *counts = (problem.origin[name] for name in names)
        return Difficulty(len(problem.objects), Hiddenness(str(group)), float(fraction), *map(int, counts))
    except (KeyError, ValueError):
        return None
