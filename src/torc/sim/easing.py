"""Easing objects out of each other: annotated scenes put them a few millimetres, sometimes centimetres, inside."""

from dataclasses import dataclass

import mujoco
import numpy as np

from torc.sim.world import World


@dataclass(frozen=True)
class EaseConfig:
    """When to stop.

    Attributes:
        depth_m: nothing may be deeper inside something else; ordinary settling copes with that.
        max_steps: time steps after which it is given up. An overlap shrinks by 1 % a step.
    """

    depth_m: float = 0.002
    max_steps: int = 1000


@dataclass(frozen=True)
class EaseReport:
    """What easing did.

    Attributes:
        before_m, after_m: how deep the deepest two bodies were inside each other; 0 if none were.
        steps: how many time steps it took.
    """

    before_m: float
    after_m: float
    steps: int


def ease_apart(world: World, config: EaseConfig | None = None) -> EaseReport:
    """Pushes overlapping objects apart without setting anything in motion: after every time step all are stopped.

    Let go at once instead, two bodies 2 cm inside each other shoot apart and take the scene with them.
    """
    config = config or EaseConfig()
    world.update_position_stage()
    before = depth = deepest_overlap_m(world)
    steps = 0
    while depth > config.depth_m and steps < config.max_steps:
        mujoco.mj_step(world.model, world.data)
        world.data.qvel[:] = 0.0
        steps += 1
        depth = deepest_overlap_m(world)
    world.update_position_stage()
    return EaseReport(before, deepest_overlap_m(world), steps)


def deepest_overlap_m(world: World) -> float:
    """How deep the deepest two bodies are inside each other, as of the last contact detection; 0 if none are."""
    return float(np.max(-world.data.contact.dist, initial=0.0))
