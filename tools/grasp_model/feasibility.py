"""Which library models the gripper gets hold of at all: each alone on the table, tried in the simulator.

A model stands in its natural pose, turned a few ways, and lies as it came to rest after falling. In each pose the
best candidates of the grasp planner are tried with the floating gripper until one holds.
"""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from rich.console import Console

from tools.grasp_model.facts import model_digest, save_facts
from tools.grasp_model.floating import FloatingGripper
from tools.grasp_model.floating_model import build_floating
from tools.grasp_model.snapshot import Eyes, interpret, observe
from torc.errors import PhysicsError
from torc.geometry.transforms import rotation_about, rotation_from_wxyz, wxyz_from_rotation
from torc.grasping.geometric_planner import GeometricGraspPlanner
from torc.grasping.protocol import GraspPlanner
from torc.objects.library import FACTS_PATH, GraspFact, builtin_object_names, load_object, read_facts
from torc.problems.problem import ObjectPlacement, Problem
from torc.robots.description import RobotDescription
from torc.robots.loading import load_robot
from torc.sim.rendering import CameraRenderer
from torc.sim.settling import settle, with_poses_of
from torc.sim.simulated_world import World, build_world
from torc.workspace.description import Workspace
from torc.workspace.workspace_files import load_workspace


@dataclass(frozen=True)
class FeasibilityConfig:
    """How hard is tried.

    Attributes:
        turns: ways in which the standing model is turned, evenly over half a turn.
        falls: poses in which it came to rest after a fall.
        tries: grasps tried per pose.
        xy: where it is, world, metres: in the middle of the clutter.
        clearance_m: free height before it falls.
    """

    turns: int = 3
    falls: int = 4
    tries: int = 8
    xy: tuple[float, float] = (0.65, -0.12)
    clearance_m: float = 0.01


def measure_all(names: Sequence[str] = (), again: bool = False, path: Path = FACTS_PATH) -> None:
    """Measures models (all if none are named) and writes what came of it, after each one: it may be interrupted.

    Models that have not changed since they were measured are left out, unless `again`. Raises UnknownNameError.
    """
    facts = dict(read_facts(path)) if path.is_file() else {}
    wanted = [n for n in names or builtin_object_names() if again or not _known(facts, n)]
    robot, workspace, console = load_robot(), load_workspace(), Console(stderr=True)
    planner = GeometricGraspPlanner(robot.gripper, workspace.support_z_m)
    with console.status("") as status:
        for k, name in enumerate(wanted, start=1):
            status.update(f"{k} of {len(wanted)}: {name}")
            facts[name] = measure(name, robot, planner, workspace)
            save_facts({n: facts[n] for n in builtin_object_names() if n in facts}, path)
            print(
                f"{name:<28} standing {facts[name].standing:.2f}  tumbled {facts[name].tumbled:.2f}",
                flush=True,
            )
    never = [name for name, fact in facts.items() if fact.standing == 0.0]
    print(f"{path}: {len(wanted)} models measured, {len(facts)} known.")
    print(f"Not graspable as they stand: {', '.join(never) or 'none'}.")


def _known(facts: Mapping[str, GraspFact], name: str) -> bool:
    return name in facts and facts[name].digest == model_digest(load_object(name))


def measure(
    name: str,
    robot: RobotDescription,
    planner: GraspPlanner,
    workspace: Workspace,
    config: FeasibilityConfig | None = None,
) -> GraspFact:
    """What comes of trying to grasp a model; always the same for the same model. Raises UnknownNameError."""
    config = FeasibilityConfig() if config is None else config
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    turned = [rotation_about((0, 0, 1), np.pi * (k + 0.25) / config.turns) for k in range(config.turns)]
    placement = ObjectPlacement("thing", name, (*config.xy, workspace.support_z_m), (1.0, 0.0, 0.0, 0.0))
    problem = Problem("alone", "structured", "", "thing", (placement,))
    world = build_world(problem, None, workspace)
    with CameraRenderer(world, workspace.camera) as renderer:
        trials = _Trials(world, renderer, robot, planner, config)
        standing = trials.share_held(turned)
        tumbled = trials.share_held([_random_rotation(rng) for _ in range(config.falls)])
    return GraspFact(standing, tumbled, model_digest(load_object(name)))


def _random_rotation(rng: np.random.Generator) -> Float[np.ndarray, "3 3"]:
    """A uniformly random orientation."""
    q = rng.normal(size=4)
    return rotation_from_wxyz(q / np.linalg.norm(q))


@dataclass(frozen=True)
class _Trials:
    """Tries to grasp the one object of a world."""

    world: World
    renderer: CameraRenderer
    robot: RobotDescription
    planner: GraspPlanner
    config: FeasibilityConfig

    def share_held(self, rotations: Sequence[Float[np.ndarray, "3 3"]]) -> float:
        """The share of the poses in which some grasp held, of those in which the object came to rest; 0 without any."""
        held = [self._held() for R in rotations if self._comes_to_rest(R)]
        return round(sum(held) / len(held), 3) if held else 0.0

    def _comes_to_rest(self, R: Float[np.ndarray, "3 3"]) -> bool:
        """Lets the object down onto the table; False if it rolls off or never rests."""
        lowest = float(self.world.models[0].support(-R[2:3])[0])
        z = self.world.workspace.support_z_m + lowest + self.config.clearance_m
        self.world.set_object_pose(0, np.array([*self.config.xy, z]), wxyz_from_rotation(R))
        try:
            report = settle(self.world)
        except PhysicsError:
            return False
        return report.settled and not report.left

    def _held(self) -> bool:
        """Whether one of the best grasps that the planner proposes for the object as it lies holds."""
        workspace = self.world.workspace
        rng = np.random.default_rng(0)
        scene, volume = interpret(observe(self.renderer, workspace.camera), workspace, Eyes.EXACT, rng)
        grasps = self.planner.plan(scene, volume, rng)
        if len(grasps) == 0:
            return False
        gripper = FloatingGripper(build_floating(with_poses_of(self.world), self.robot, workspace))
        order = np.argsort(-grasps.scores, kind="stable")[: self.config.tries]
        return any(
            gripper.trial(0, grasps.Ts_world_tcp[k], float(grasps.widths_m[k])).delivered for k in order
        )
