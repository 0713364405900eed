"""Objects at rest that MuJoCo does not compute until something touches them. `mjData.tree_asleep` is negative for a
tree of bodies that is awake, else the next tree of the ring of those that wake together. Who writes to it must also
write what is derived from it, for which MuJoCo's Python binding has no call.
"""

import mujoco
import numpy as np
from jaxtyping import Int

AWAKE = -1 - mujoco.mjMINAWAKE
"""Of `tree_asleep`: awake, and as many steps of rest away from sleep as can be."""


def wake_all(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Ends the sleep of everything."""
    put_to_sleep(model, data, np.full(model.ntree, AWAKE))


def put_to_sleep(model: mujoco.MjModel, data: mujoco.MjData, tree_asleep: Int[np.ndarray, "t"]) -> None:
    """Declares what sleeps and what is awake, as `data.tree_asleep` was read from a world built alike; positions must
    be up to date. What is derived from it is as `mj_updateSleep` makes it.
    """
    data.tree_asleep[:] = tree_asleep
    tree_awake = data.tree_asleep < 0
    data.tree_awake[:], data.ntree_awake = tree_awake, int(tree_awake.sum())
    moving = model.body_treeid >= 0
    data.body_awake[moving] = np.where(
        tree_awake[model.body_treeid[moving]],
        int(mujoco.mjtSleepState.mjS_AWAKE),
        int(mujoco.mjtSleepState.mjS_ASLEEP),
    )
    computed = data.body_awake != int(mujoco.mjtSleepState.mjS_ASLEEP)
    data.nbody_awake = _list(data.body_awake_ind, np.flatnonzero(computed))
    parents = 1 + np.flatnonzero(computed[model.body_parentid[1:]])
    data.nparent_awake = _list(data.parent_awake_ind, parents)
    awake = moving & (data.body_awake == int(mujoco.mjtSleepState.mjS_AWAKE))
    data.nv_awake = _list(data.dof_awake_ind, np.flatnonzero(awake[model.dof_bodyid]))


def _list(into: Int[np.ndarray, "n"], indices: Int[np.ndarray, "k"]) -> int:
    into[: len(indices)] = indices
    return len(indices)
