"""How far a held object can reach at most, seen from where it was lifted to."""

from collections.abc import Iterator
from itertools import product

import numpy as np
from jaxtyping import Float

from torc.collision.contacts import attached_contacts
from torc.motion.line_context import LineContext

_SHARES = (0.75, 0.67, 0.5, 0.0)
"""A radius is cut to these shares of what it was before, in turn: to 3/4, 1/2, 1/4, nothing."""


def cut_extents(context: LineContext, qpos: Float[np.ndarray, "dof"]) -> Iterator[Float[np.ndarray, "a 4"]]:
    """What is held, as spheres (tool0 frame) that touch nothing fixed at a configuration, the largest first; nothing
    where it touched none before.

    The object is there, so it does not go on inside a wall or a roof, though rough depth may smear it toward them. What
    would touch is first made small enough, then left out.
    """
    for shares, extent in product((_SHARES, ()), (context.held.possible, context.held.seen)):
        held = _cut(context, qpos, extent, shares)
        if held is not extent:
            yield held


def _cut(
    context: LineContext,
    qpos: Float[np.ndarray, "dof"],
    held: Float[np.ndarray, "a 4"],
    shares: tuple[float, ...],
) -> Float[np.ndarray, "b 4"]:
    for share in (*shares, None):
        touching = attached_contacts(context.world, context.robot, qpos, context.width_m, held)
        if not touching.any():
            break
        if share is None:
            held = held[~touching]
        else:
            held = np.where(touching[:, None], held * (1.0, 1.0, 1.0, share), held)
    return held
