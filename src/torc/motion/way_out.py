"""Out of contact: where the arm truly stands, the checks may say that it touches table, bin or itself."""

import numpy as np
from jaxtyping import Float

from torc.motion.space import FreeSpace, loosened

_DEPTHS_M = (0.005, 0.010, 0.015, 0.020, 0.030)
_RADII_RAD = (0.03, 0.1, 0.3)
_TRIES = 200


def way_out(
    space: FreeSpace, start: Float[np.ndarray, "dof"], rng: np.random.Generator
) -> Float[np.ndarray, "dof"] | None:
    """The nearest free configuration found to which a straight edge leads without deeper contact than at the start.

    The start itself if it is free. None if it is in contact by more than 3 cm (paddings included) or nothing free is
    near.
    """
    if not space.collides(start[None])[0]:
        return start
    for depth in _DEPTHS_M:
        looser = loosened(space, depth, itself_too=True)
        if looser.collides(start[None])[0]:
            continue
        for radius in _RADII_RAD:
            offsets = rng.uniform(-radius, radius, (_TRIES, len(start)))
            near = np.clip(start + offsets, space.lower, space.upper)
            free = near[~space.collides(near)]
            free = free[~looser.edges_collide(start, free)]
            if len(free):
                return free[np.argmin(space.seconds_between(start, free))]
        return None
    return None
