"""Saving and restoring a world, bit for bit: what runs on from a restored state is identical in its last bits.

This is the world alone. What a robot in it remembers besides, e.g. the force that its gripper was told to hold on
with, is in `SimulatedRobot.save`.
"""

import mujoco
import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.sim.world import World

_PARTS = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_WARNINGS = int(mujoco.mjtWarning.mjNWARNING)


def save_state(world: World) -> Float[np.ndarray, "s"]:
    """Everything that decides the world's future, as one array: MuJoCo's integration state (time, positions,
    velocities, warm start, controls, forces), then each object's Presence, then MuJoCo's counts of warnings, by which
    the watchdog tells that a simulation diverged.
    """
    state = np.empty(mujoco.mj_stateSize(world.model, _PARTS))
    mujoco.mj_getState(world.model, world.data, state, _PARTS)
    warnings = [float(warning.number) for warning in world.data.warning]
    return np.concatenate([state, world.presence.astype(float), warnings])


def restore_state(world: World, state: Float[np.ndarray, "s"]) -> None:
    """Puts a world into a state saved from it, or from one built alike, maybe in another process.

    Raises:
        InputError: the state belongs to another world (its size differs).
    """
    size = mujoco.mj_stateSize(world.model, _PARTS)
    ends = np.cumsum([size, world.object_count, _WARNINGS])
    if state.shape != (ends[-1],):
        raise InputError(
            f"The state has {state.shape} numbers, this world needs {ends[-1]}: "
            "it was saved from a world with other objects or another robot."
        )
    mujoco.mj_setState(world.model, world.data, np.ascontiguousarray(state[:size]), _PARTS)
    world.presence[:] = state[size : ends[1]].astype(np.uint8)
    for warning, number in zip(world.data.warning, state[ends[1] :], strict=True):
        warning.number = int(number)
    world.update_position_stage()
