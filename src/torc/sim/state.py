"""Save and restore a world, bit for bit. `SimulatedRobot.save` covers what a robot in it remembers besides."""

import mujoco
import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.sim.simulated_world import World, put_to_sleep

_PARTS = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_WARNINGS = int(mujoco.mjtWarning.mjNWARNING)


def save_state(world: World) -> Float[np.ndarray, "s"]:
    """Return everything that decides the world's future, as one array: MuJoCo's integration state, each object's
    Presence, MuJoCo's counts of warnings, by which the watchdog detects a diverged simulation, and what sleeps.
    """
    state = np.empty(mujoco.mj_stateSize(world.model, _PARTS))
    mujoco.mj_getState(world.model, world.data, state, _PARTS)
    warnings = [float(warning.number) for warning in world.data.warning]
    asleep = world.data.tree_asleep.astype(float)
    return np.concatenate([state, world.presence.astype(float), warnings, asleep])


def refresh(world: World) -> None:
    """Forget how the world got into its state, so that it continues as a restored copy would.

    If objects may sleep, MuJoCo remembers more of that.
    """
    restore_state(world, save_state(world))


def restore_state(world: World, state: Float[np.ndarray, "s"]) -> None:
    """Restore a state saved from this world, or from one built alike, maybe in another process.

    Raises InputError for a state of another size.
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
    # Nothing is computed for sleeping bodies: their poses have to be up to date before.
    world.wake()
    world.update_position_stage()
    put_to_sleep(world.model, world.data, state[ends[2] :].astype(int))
    world.update_position_stage()
