"""Looks at a problem without some of its objects: contexts, of which few are kept, and what a search needs of them."""

from collections import OrderedDict

from torc.episode.privileged import Sandbox, Truth
from torc.next_object.making.valuing import Gone, Seen, seen_in
from torc.records import PlanningContext

_KEPT = 12
"""Contexts: each holds a volume."""


class Looks:
    """Looks from a problem's beginning, each taken once as far as it is still kept. All raise PhysicsError."""

    def __init__(self, sandbox: Sandbox) -> None:
        self._sandbox, self._start = sandbox, sandbox.begin()
        self._contexts: OrderedDict[Gone, PlanningContext] = OrderedDict()
        self._seen: dict[Gone, Seen] = {}

    def context(self, gone: Gone) -> PlanningContext:
        """What a planner is shown when these are gone, all of them taken without a failure."""
        if gone not in self._contexts:
            context = self._sandbox.look_without(self._start, gone).context
            self._contexts[gone], self._seen[gone] = context, seen_in(context)
            if len(self._contexts) > _KEPT:
                self._contexts.popitem(last=False)
        return self._contexts[gone]

    def seen(self, gone: Gone) -> Seen:
        """What a search for values needs of that look."""
        if gone not in self._seen:
            self.context(gone)
        return self._seen[gone]

    def context_and_truth(self, gone: Gone) -> tuple[PlanningContext, Truth]:
        """The look, taken anew, and what is so then."""
        context = self._sandbox.look_without(self._start, gone).context
        return context, self._sandbox.truth(self._sandbox.now(self._start))
