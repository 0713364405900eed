"""Run every numerical kernel once, ahead of time.

Kernels are compiled at their first use (a few minutes in all on a slow machine) and cached on disk by numba. A
rehearsal runs every kernel of the given parts once on a made-up snapshot, so that neither compilation nor loading
counts as planning time later. It is short if everything is cached.
"""

import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numba.core import event

from torc.collision.contact_kernels import contacts_batch
from torc.geometry.transforms import make_pose
from torc.perception.stereo import made_up_pair
from torc.pipeline.look import Look, Pipeline
from torc.pipeline.state import EpisodeState
from torc.records import BACKGROUND, TARGET_ID, Capture, Observation
from torc.workspace.description import Workspace

MESSAGE = "Compiling numerical kernels: a minute or more, once; they are cached for the next time."
_EVERY_S = 10.0
"""Time between two lines that say how far the compilation is."""


def announced_compilation(say: Callable[[str], None] | None = None) -> AbstractContextManager[None]:
    """Say MESSAGE as soon as something has to be compiled in the block, then how far it is; on stderr by default."""
    say = say or (lambda text: print(text, file=sys.stderr, flush=True))
    return event.install_listener("numba:compile", _Announcer(say))


class _Announcer(event.Listener):
    """Says its message once, and every _EVERY_S how many kernels are compiled."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self.say, self.compiled, self.begin_s, self.said_s = say, 0, 0.0, 0.0

    def on_start(self, _: Any) -> None:
        if not self.begin_s:
            self.begin_s = self.said_s = time.monotonic()
            self.say(MESSAGE)

    def on_end(self, _: Any) -> None:
        self.compiled, now_s = self.compiled + 1, time.monotonic()
        if now_s > self.said_s + _EVERY_S:
            self.said_s = now_s
            self.say(f"  {self.compiled} kernels after {now_s - self.begin_s:.0f} s ...")


def kernel_cache() -> tuple[Path, bool]:
    """Return where numba caches torc's kernels, and whether anything is there yet."""
    path = Path(contacts_batch.stats.cache_path or ".")
    return path, any(path.glob("contact_kernels.contacts_batch-*.nbi"))


def rehearse_look(pipeline: Pipeline, qpos: Float[np.ndarray, "dof"] | None = None) -> Look:
    """Look twice at two small boxes, one of which moves in between; return the second look. `qpos` is the arm's."""
    qpos = np.zeros(0) if qpos is None else qpos
    look = pipeline.look(_snapshot(pipeline.workspace, 50, qpos))
    return pipeline.look(_snapshot(pipeline.workspace, 95, qpos), EpisodeState(look.context.volume))


def _snapshot(workspace: Workspace, column: int, qpos: np.ndarray) -> Capture:
    """Make a snapshot of two boxes on the table from 0.8 m straight above its grid's middle; one at an image column."""
    height, width, focal, above = 120, 160, 200.0, 0.8
    depth_m = np.full((height, width), above, dtype=np.float32)
    label = np.full((height, width), BACKGROUND, dtype=np.int16)
    for object_id, first in ((TARGET_ID, column), (1, 65)):
        place = slice(50, 65), slice(first, first + 13)
        depth_m[place], label[place] = above - 0.06, object_id
    middle = 0.5 * (workspace.grid.origin + workspace.grid.upper)
    R_world_camera = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    observation = Observation(
        rgb=np.zeros((height, width, 3), dtype=np.uint8),
        depth_m=depth_m,
        K=np.array([[focal, 0.0, 0.5 * (width - 1)], [0.0, focal, 0.5 * (height - 1)], [0.0, 0.0, 1.0]]),
        T_world_camera=make_pose(R_world_camera, [middle[0], middle[1], workspace.support_z_m + above]),
        qpos=qpos,
        stamp_s=0.0,
        pair=made_up_pair(depth_m, focal),
    )
    return Capture(observation, label)
