"""Look at the lifted object before delivering it: is it the target?"""

from dataclasses import dataclass

import numpy as np

from torc.perception.checked_scenes import ask_recognition
from torc.perception.in_hand import held_mask
from torc.perception.protocol import Wanted
from torc.pipeline.look import Look, Pipeline
from torc.records import Capture, Observation
from torc.registry.kinds import DEPTHS
from torc.robots.description import RobotDescription

SURE = 0.9
"""From this probability on, the object in the hand counts as the target. It is above .5 because a wrong object that is
delivered as the target ends the work, while an unrecognised target reaches the bin anyway.
"""


@dataclass
class HeldLook:
    """A `torc.robots.protocols.HeldCheck` for one pick: asks perception.

    Attributes:
        p: the probability that it is the target; None until asked, or if perception cannot say.
    """

    pipeline: Pipeline
    robot: RobotDescription
    look: Look
    wanted: Wanted
    object_id: int
    rng: np.random.Generator
    p: float | None = None

    @property
    def is_target(self) -> bool:
        """True if the in-hand look says so; without one, if it was believed to be the target before."""
        return self.object_id == self.look.context.scene.target_id if self.p is None else self.p >= SURE

    def __call__(self, observation: Observation, width_m: float) -> bool:
        """Return whether the object in the hand is the target. Raises PartError if perception or depth crashed."""
        scene, pipeline = self.look.context.scene, self.pipeline
        then = scene.observation
        seen = pipeline.measured(Capture(observation), self.rng).observation
        same_view = np.array_equal(seen.T_world_camera, then.T_world_camera)
        before_m = then.depth_m.copy() if same_view else np.zeros_like(then.depth_m)
        before_m[tuple(scene.object(self.object_id).pixels.T)] = 0
        rough = DEPTHS.traits(pipeline.depth).rough or pipeline.noise is not None
        mask = held_mask(seen, before_m, self.robot, width_m, rough)
        self.p = ask_recognition(pipeline.perception, seen, mask, self.wanted, scene, self.object_id)
        return self.is_target
