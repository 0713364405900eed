"""Saving and restoring a world, bit for bit: what runs on from a restored state is identical in its last bits.

Save between picks: while the gripper holds on, its force is a setting of the robot and not in the world's state.
"""

import mujoco
import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.sim.world import World

_PARTS = int(mujoco.mjtState.mjSTATE_INTEGRATION)


def save_state(world: World) -> Float[np.ndarray, "s"]:
    """Everything that decides the world's future, as one array: MuJoCo's integration state (time, positions,
    velocities, warm start, controls, forces), then each object's Presence.
    """
    state = np.empty(mujoco.mj_stateSize(world.model, _PARTS))
    mujoco.mj_getState(world.model, world.data, state, _PARTS)
    return np.concatenate([state, world.presence.astype(float)])


def restore_state(world: World, state: Float[np.ndarray, "s"]) -> None:
    """Puts a world into a state saved from it, or from one built alike, maybe in another process.

    Raises:
        InputError: the state belongs to another world (its size differs).
    """
    size = mujoco.mj_stateSize(world.model, _PARTS)
    if state.shape != (size + world.object_count,):
        raise InputError(
            f"The state has {state.shape} numbers, this world needs {size + world.object_count}: "
            "it was saved from a world with other objects or another robot."
        )
    mujoco.mj_setState(world.model, world.data, np.ascontiguousarray(state[:size]), _PARTS)
    world.presence[:] = state[size:].astype(np.uint8)
    world.update_position_stage()
