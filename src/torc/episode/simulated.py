"""Make a simulated robot for a problem, with the parts that its conditions name."""

from collections.abc import Sequence
from dataclasses import replace

from torc.episode.events import Listener
from torc.episode.loop import Episode
from torc.episode.steps import EpisodeConfig
from torc.errors import InputError
from torc.objects.library import load_object
from torc.objects.models import ObjectModel
from torc.perception.protocol import Wanted
from torc.pipeline.building import System, configured, make_stage
from torc.problems.problem import Problem
from torc.records import TARGET_ID
from torc.registry.context import BuildContext
from torc.registry.kinds import CAMERAS, DEPTHS, PERCEPTIONS, STAGES
from torc.sim.portraits import size_by_ruler, turn_table
from torc.sim.robot import SimulatedRobot, SimulatedRobotConfig
from torc.sim.simulated_world import build_world
from torc.sim.stepping import Observer
from torc.specs.conditions import Conditions


def simulated_robot(
    system: System, problem: Problem, *, color: bool = True, observer: Observer | None = None
) -> SimulatedRobot:
    """Return the system's robot in the problem's world, as built. Close it, or use it in a `with`.

    Args:
        system: the parts.
        problem: the scene.
        color: False saves the color pictures, if all parts read only depth and labels.
        observer: called with the world about 25 times per simulated second.

    Raises:
        InputError: the problem cannot be built, or the camera cannot be made.
    """
    config = configured(system.conditions, "simulation", SimulatedRobotConfig())
    pairs = DEPTHS.traits(system.pipeline.depth).needs_pair
    config = replace(config, color=color and config.color, pairs=pairs or config.pairs)
    world = build_world(problem, system.robot, system.workspace)
    world.model.geom_friction[:, 0] *= system.conditions.friction
    simulated = SimulatedRobot(world, config, observer)
    context = BuildContext(camera=simulated.camera, workspace=system.workspace)
    camera = make_stage(system.conditions, "camera", context)
    if CAMERAS.traits(camera).real:
        raise InputError(
            f"--camera {system.conditions.camera} looks at the real world, which a simulated robot does not change. "
            "`torc camera show` and `torc camera record` use it; `torc decide` decides for what it recorded."
        )
    simulated.look_through(camera)
    return simulated


def episode_in(
    simulated: SimulatedRobot, system: System, config: EpisodeConfig, listeners: Sequence[Listener] = ()
) -> Episode:
    """Return the episode of a simulated robot at its problem, before the first look."""
    return Episode(simulated, system, wanted_in(system, simulated.world.problem), config, listeners)


def wanted_in(system: System, problem: Problem) -> Wanted:
    """Return the problem's target as its user would describe it: in words and by its size.

    Adds pictures from all sides if the system's perception asks for them.
    """
    if PERCEPTIONS.traits(system.pipeline.perception).needs_pictures:
        return pictured_target(problem)
    return Wanted(problem.description, size_m=size_by_ruler(_target_of(problem)))


def pictured_target(problem: Problem) -> Wanted:
    """Return the problem's target with pictures from all sides, as on a turn-table."""
    model = _target_of(problem)
    return Wanted(problem.description, turn_table(model), size_m=size_by_ruler(model))


def _target_of(problem: Problem) -> ObjectModel:
    return load_object(problem.ordered()[TARGET_ID].model)


def needs_color(system: System) -> bool:
    """Check whether any part around the planner may read the colour picture: the default ones read depth and masks."""
    used, default = system.conditions, Conditions()
    return any(getattr(used, stage) != getattr(default, stage) for stage in STAGES)
