"""Tells a simulated VLM, and nobody else, what is so in a trial."""

import numpy as np

from torc.episode.events import Event, Looked
from torc.episode.privileged import Simulation, Truth
from torc.errors import InputError
from torc.pipeline.look import Look
from torc.records import PlanningContext
from torc.task_planning.relations import find_adjacencies
from torc.vlm.simulated.situation import Situation

_MIN_HIDDEN_PX = 10
_MIN_HIDDEN_SHARE = 0.03


class Situations:
    """The situation at the latest look of a trial. It is one of the trial's listeners."""

    def __init__(self) -> None:
        self._simulation: Simulation | None = None
        self._look: Look | None = None
        self._situation: Situation | None = None

    def attach(self, simulation: Simulation) -> None:
        """Take the simulation of a trial."""
        self._simulation, self._look, self._situation = simulation, None, None

    def __call__(self, event: Event) -> None:
        """Remember what was seen."""
        if isinstance(event, Looked):
            self._look, self._situation = event.look, None

    def situation(self) -> Situation:
        """What is so now, between two picks. Raises InputError if no trial has begun."""
        if self._situation is None:
            if self._simulation is None or self._look is None:
                raise InputError("The simulated VLM was asked outside of a simulated trial; use torc run.")
            self._situation = situation_of(self._look.context, self._simulation.truth())
        return self._situation


def situation_of(context: PlanningContext, truth: Truth) -> Situation:
    """What is so, in the terms of a marked image. Who lies on whom and who hides whom is the simulator's truth. Which
    objects carry a number, which can be grasped and who is in the way of that is what the pipeline found: it is by this
    that a choice is judged.
    """
    scene, report, counted, ids = context.scene, context.report, truth.visibility, context.report.object_ids
    enough = np.maximum(_MIN_HIDDEN_PX, _MIN_HIDDEN_SHARE * counted.pixels_alone)
    hides = np.argwhere(counted.hidden_by >= enough[:, None]).tolist()
    return Situation(
        in_sight={o.id: o.pixel_count for o in scene.objects},
        graspable=frozenset(k for k in report.graspable_ids if k in scene.ids),
        lies_on=truth.lies_on,
        hides={(front, back): int(counted.hidden_by[back, front]) for back, front in hides},
        blocks=frozenset((ids[j], ids[i]) for i, j in np.argwhere(report.blocking > 0).tolist() if i != j),
        near=frozenset((pair.first, pair.second) for pair in find_adjacencies(scene)),
    )
