"""Looks at a problem without some of its objects: contexts, of which few are kept, and what a search needs of them."""

from collections import OrderedDict
from collections.abc import Sequence

from torc.episode.privileged import Sandbox, Truth
from torc.next_object.making.valuing import Gone, Seen, seen_in
from torc.records import PlanningContext

_KEPT = 12
"""Contexts: each holds a volume."""
DRAWS = 3
"""Looks at the same for the search, whose grasps are drawn anew in each."""


class Looks:
    """Looks from a problem's beginning, each taken once as far as it is still kept. All raise PhysicsError."""

    def __init__(self, sandbox: Sandbox, others: Sequence[Sandbox] = ()) -> None:
        """`others` draw other grasps, for `seen`."""
        self._sandbox, self._start = sandbox, sandbox.begin()
        self._others = [(other, other.begin()) for other in others]
        self._contexts: OrderedDict[Gone, PlanningContext] = OrderedDict()
        self._seen: dict[Gone, Seen] = {}

    def context(self, gone: Gone) -> PlanningContext:
        """What a planner is shown when these are gone, all of them taken without a failure."""
        if gone not in self._contexts:
            self._contexts[gone] = self._sandbox.look_without(self._start, gone).context
            if len(self._contexts) > _KEPT:
                self._contexts.popitem(last=False)
        return self._contexts[gone]

    def seen(self, gone: Gone) -> Seen:
        """What a search for values needs of that look, and of others at the same."""
        if gone not in self._seen:
            again = [other.look_without(start, gone).context for other, start in self._others]
            self._seen[gone] = seen_in([self.context(gone), *again])
        return self._seen[gone]

    def context_and_truth(self, gone: Gone) -> tuple[PlanningContext, Truth]:
        """The look, taken anew, and what is so then."""
        context = self._sandbox.look_without(self._start, gone).context
        return context, self._sandbox.truth(self._sandbox.now(self._start))
