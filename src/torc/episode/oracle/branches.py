"""The search space of an episode: what is tried in it is simulated as in a trial."""

from collections import OrderedDict

import numpy as np

from torc.episode.oracle.space import Arrival, Choice, Fate, Options
from torc.episode.privileged import Sandbox, SimulatedState
from torc.episode.state import EndReason
from torc.errors import PhysicsError
from torc.pipeline.look import Look
from torc.records import TARGET_ID, PlanningContext
from torc.task_planning.dg_select import DgSelectPlanner
from torc.task_planning.random_choice import graspable_ids

_LOOKS_KEPT = 12
"""A look takes some 10 MB."""


class Branches:
    """All that the robot can pick, from any state on."""

    def __init__(self, sandbox: Sandbox) -> None:
        self._sandbox = sandbox
        self._looks: OrderedDict[int, tuple[SimulatedState, Look]] = OrderedDict()

    def look(self, state: SimulatedState) -> Options:
        """What can be picked in that state."""
        return options(self._look(state).context)

    def pick(self, state: SimulatedState, choice: Choice) -> Arrival[SimulatedState]:
        """What comes of a pick. One that breaks the simulation leads nowhere."""
        try:
            after = self._sandbox.pick(state, self._look(state), choice)
        except PhysicsError:
            return Arrival(state, fate=Fate.LOST)
        fate = {None: Fate.OPEN, EndReason.RETRIEVED: Fate.SOLVED}.get(after.episode.end, Fate.LOST)
        outcome = after.episode.outcomes[-1]
        delivered = () if outcome.held_id is None or not outcome.delivered else (outcome.held_id,)
        return Arrival(after, len(outcome.dropped), fate, frozenset((*delivered, *outcome.dropped)))

    def peek(self, state: SimulatedState, removed: frozenset[int]) -> Options:
        """What could be picked if these objects were gone."""
        try:
            return options(self._sandbox.look_without(state, removed).context)
        except PhysicsError:
            return Options(())

    def _look(self, state: SimulatedState) -> Look:
        """The look at a state; taken again, with the same result, if it was long ago."""
        key = id(state)
        if key in self._looks:
            self._looks.move_to_end(key)
        else:
            # The state is kept, too, so that its id stays its own.
            self._looks[key] = state, self._sandbox.look(state)
            if len(self._looks) > _LOOKS_KEPT:
                self._looks.popitem(last=False)
        return self._looks[key][1]


def options(context: PlanningContext) -> Options:
    """What can be picked: the visible objects that have a valid grasp; where none has, a pick can only pass.

    The target comes first, then by the dependency graph.
    """
    graspable, target_seen = graspable_ids(context), context.scene.target_id is not None
    target = TARGET_ID if TARGET_ID in graspable else None
    choices: tuple[Choice, ...] = (None,) if context.scene.objects else ()
    if graspable:
        # DG-SELECT draws nothing.
        first = DgSelectPlanner().decide(context, np.random.default_rng(0))
        p = first.evidence["probabilities"]
        places = [(k != TARGET_ID, k != first.object_id, -p.get(str(k), 0.0), k) for k in graspable]
        choices = tuple(k for *_, k in sorted(places))
    outlook = 2.0 * (target is not None) + target_seen + float(np.mean(context.volume.seen))
    note = "the target is hidden"
    if target_seen:
        note = "the target is in sight, " + ("and can be picked" if target is not None else "but blocked")
    return Options(choices, target, outlook, note)
