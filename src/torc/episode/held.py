"""Looking at what was lifted, before it is brought: is it the target?"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from torc.perception.asking import ask_recognition
from torc.perception.in_hand import held_mask
from torc.perception.protocol import Wanted
from torc.pipeline.look import Look, Pipeline
from torc.records import TARGET_ID, Observation
from torc.robots.description import RobotDescription

SURE = 0.8
"""From this probability on, what is in the hand is the target, if one side of it was seen."""
SURE_OF_SEVERAL = 0.93
"""The same for the surest of several sides: each is another chance to look like the target."""
_CLEAR = (0.1, 0.97)
"""Below and above this, one side is enough."""


@dataclass
class HeldLook:
    """A `torc.robots.protocols.HeldCheck` for one pick: asks perception.

    Attributes:
        sides: how surely each side that was seen shows the target; as long as none was, how surely it was before.
    """

    pipeline: Pipeline
    robot: RobotDescription
    look: Look
    wanted: Wanted
    object_id: int
    rng: np.random.Generator
    sides: list[float] = field(default_factory=list)
    seen: bool = False

    @property
    def p(self) -> float | None:
        """By the surest side; None as long as nobody asked, or where perception cannot tell."""
        return max(self.sides, default=None)

    @property
    def is_target(self) -> bool:
        """By what was seen in the hand; else what it was believed to be."""
        return bool(told_by(self.sides, last=True)) if self.sides else self.object_id == TARGET_ID

    def __call__(self, observation: Observation, width_m: float, last: bool) -> bool | None:
        """Whether the object in the hand is the target; None if another side should be seen, and it is not the last.
        Raises PartError if perception or depth crashed.
        """
        scene, pipeline = self.look.context.scene, self.pipeline
        then = scene.observation
        seen = replace(pipeline.measured(observation, self.rng), label_image=None)
        same_view = np.array_equal(seen.T_world_camera, then.T_world_camera)
        before_m = then.depth_m.copy() if same_view else np.zeros_like(then.depth_m)
        before_m[tuple(scene.object(self.object_id).pixels.T)] = 0
        rough = getattr(pipeline.depth, "rough", False) or pipeline.noise is not None
        mask = held_mask(seen, before_m, self.robot, width_m, rough)
        p = ask_recognition(pipeline.perception, seen, mask, self.wanted, scene, self.object_id)
        if p is None:
            return self.is_target
        if mask.any() and not self.seen:
            self.sides, self.seen = [p], True
        elif mask.any() or not self.sides:
            self.sides.append(p)
        return told_by(self.sides, last)


def told_by(sides: Sequence[float], last: bool) -> bool | None:
    """Whether an object is the target, by how surely each of its sides shows it; None if another one should tell."""
    best, several = max(sides), len(sides) > 1
    if not last and _CLEAR[0] < best < (SURE_OF_SEVERAL if several else _CLEAR[1]):
        return None
    return best >= (SURE_OF_SEVERAL if several else SURE)
