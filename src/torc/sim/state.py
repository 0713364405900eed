"""Saving and restoring a world, bit for bit: what runs on from a restored state is the same each time, in any world
built alike, in its last bits.

Where objects may sleep, MuJoCo remembers more of how it got to a state than the state itself. Whoever wants to run on
from a state that he saved, as if it had been restored, calls `refresh`.

This is the world alone. What a robot in it remembers besides, e.g. the force that its gripper was told to hold on
with, is in `SimulatedRobot.save`.
"""

import mujoco
import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.sim.sleeping import put_to_sleep
from torc.sim.world import World

_PARTS = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_WARNINGS = int(mujoco.mjtWarning.mjNWARNING)


def save_state(world: World) -> Float[np.ndarray, "s"]:
    """Everything that decides the world's future, as one array: MuJoCo's integration state (time, positions,
    velocities, warm start, controls, forces), then each object's Presence, then MuJoCo's counts of warnings, by which
    the watchdog tells that a simulation diverged, then what sleeps.
    """
    state = np.empty(mujoco.mj_stateSize(world.model, _PARTS))
    mujoco.mj_getState(world.model, world.data, state, _PARTS)
    warnings = [float(warning.number) for warning in world.data.warning]
    asleep = world.data.tree_asleep.astype(float)
    return np.concatenate([state, world.presence.astype(float), warnings, asleep])


def refresh(world: World) -> None:
    """Forgets how the world got into its state: what follows is what follows from a restored copy of it."""
    restore_state(world, save_state(world))


def restore_state(world: World, state: Float[np.ndarray, "s"]) -> None:
    """Puts a world into a state saved from it, or from one built alike, maybe in another process.

    Raises:
        InputError: the state belongs to another world (its size differs).
    """
    size = mujoco.mj_stateSize(world.model, _PARTS)
    ends = np.cumsum([size, world.object_count, _WARNINGS, world.model.ntree])
    if state.shape != (ends[-1],):
        raise InputError(
            f"The state has {state.shape} numbers, this world needs {ends[-1]}: "
            "it was saved from a world with other objects or another robot."
        )
    mujoco.mj_resetData(world.model, world.data)
    mujoco.mj_setState(world.model, world.data, np.ascontiguousarray(state[:size]), _PARTS)
    world.presence[:] = state[size : ends[1]].astype(np.uint8)
    for warning, number in zip(world.data.warning, state[ends[1] : ends[2]], strict=True):
        warning.number = int(number)
    # Of what sleeps nothing is computed any more: its poses have to be up to date before.
    world.wake()
    world.update_position_stage()
    put_to_sleep(world.model, world.data, state[ends[2] :].astype(int))
    world.update_position_stage()
