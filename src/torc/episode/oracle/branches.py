"""The search space of an episode: what is tried in it is simulated as in a trial."""

from collections import OrderedDict

import numpy as np

from torc.episode.oracle.space import Arrival, Choice, Fate, Options
from torc.episode.privileged import Moment, Sandbox
from torc.episode.state import EndReason
from torc.errors import PhysicsError
from torc.pipeline.look import Look
from torc.records import TARGET_ID, PickOutcome, PlanningContext
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.random_choice import graspable_ids

_LOOKS_KEPT = 12
"""A look takes some 10 MB."""


class Branches:
    """All that the robot can pick, from any moment on."""

    def __init__(self, sandbox: Sandbox) -> None:
        self._sandbox = sandbox
        self._looks: OrderedDict[int, tuple[Moment, Look]] = OrderedDict()

    def look(self, state: Moment) -> Options:
        """What can be picked at that moment."""
        return options(self._look(state).context)

    def pick(self, state: Moment, choice: Choice) -> Arrival[Moment]:
        """What comes of a pick. One that breaks the simulation leads nowhere."""
        try:
            moment = self._sandbox.pick(state, self._look(state), choice)
        except PhysicsError:
            return Arrival(state, fate=Fate.LOST)
        fate = {None: Fate.OPEN, EndReason.RETRIEVED: Fate.SOLVED}.get(moment.episode.end, Fate.LOST)
        outcome = moment.episode.outcomes[-1]
        return Arrival(moment, len(outcome.dropped), fate, _gone(outcome))

    def peek(self, state: Moment, removed: frozenset[int]) -> Options:
        """What could be picked if these objects were gone."""
        try:
            return options(self._sandbox.look_without(state, removed).context)
        except PhysicsError:
            return Options(())

    def _look(self, moment: Moment) -> Look:
        """The look at a moment; taken again, with the same result, if it was long ago."""
        key = id(moment)
        if key in self._looks:
            self._looks.move_to_end(key)
        else:
            # The moment is kept, too, so that its id stays its own.
            self._looks[key] = moment, self._sandbox.look(moment)
            if len(self._looks) > _LOOKS_KEPT:
                self._looks.popitem(last=False)
        return self._looks[key][1]


def _gone(outcome: PickOutcome) -> frozenset[int]:
    """Objects that left the table by a pick."""
    delivered = () if outcome.held_id is None or not outcome.delivered else (outcome.held_id,)
    return frozenset((*delivered, *outcome.dropped))


def options(context: PlanningContext) -> Options:
    """What can be picked: the visible objects that have a valid grasp; where none has, a pick can only pass.

    The target comes first, then by the dependency graph.
    """
    graspable, target_seen = graspable_ids(context), context.scene.target_id is not None
    target = TARGET_ID if TARGET_ID in graspable else None
    choices: tuple[Choice, ...] = ()
    if graspable:
        choices = _promising_first(context, graspable)
    elif context.scene.objects:
        choices = (None,)
    outlook = 2.0 * (target is not None) + target_seen + float(np.mean(context.volume.seen))
    if not target_seen:
        note = "the target is hidden"
    else:
        note = "the target is in sight, " + ("and can be picked" if target is not None else "but blocked")
    return Options(choices, target, outlook, note)


def _promising_first(context: PlanningContext, graspable: tuple[int, ...]) -> tuple[int, ...]:
    # DG-SELECT draws nothing.
    decision = DgSelectPlanner().decide(context, np.random.default_rng(0))
    probabilities = decision.evidence["probabilities"]

    def place(k: int) -> tuple[bool, bool, float, int]:
        return k != TARGET_ID, k != decision.object_id, -probabilities.get(str(k), 0.0), k

    return tuple(sorted(graspable, key=place))
