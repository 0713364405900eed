"""Looks at a problem without some of its objects: contexts, of which few are kept, and what a search needs of them."""

import itertools
from collections import OrderedDict
from collections.abc import Iterable, Iterator, Mapping

from torc import PlanningContext
from torc.episode.privileged import Sandbox, Truth
from torc.oracle.solve import MAX_PICKS, best_hold, options_of
from torc.records import TARGET_ID
from torc_next_object.making.pricing import NEVER, Price, price_of
from torc_next_object.making.valuing import Gone, Seen

_KEPT = 12
"""Contexts: each holds a volume."""
DRAWS = 2
"""Looks at the same for the search, whose grasps are drawn anew in each."""
FURTHER_DRAWS = 8
"""What they leave in doubt is drawn again so often."""
_FIRST_SEEDS = range(1, 1 + DRAWS)
_FURTHER_SEEDS = range(1 + DRAWS, 1 + DRAWS + FURTHER_DRAWS)
_SURE = 0.9
"""What holds so surely in all draws is not in doubt."""
Holds = tuple[float, ...]


class Looks:
    """Looks from a problem's beginning, each taken once as far as it is still kept. All raise PhysicsError."""

    def __init__(self, sandbox: Sandbox) -> None:
        """The sandbox's own draws are those of the contexts."""
        self._sandbox, self._start = sandbox, sandbox.begin()
        self._contexts: OrderedDict[Gone, PlanningContext] = OrderedDict()
        self._seen: dict[Gone, Seen] = {}
        self._settled: dict[tuple[int, Holds], Holds] = {}
        self._more: dict[Gone, list[dict[int, float]]] = {}

    def context(self, gone: Gone) -> PlanningContext:
        """What a planner is shown when these are gone, all of them taken without a failure."""
        if gone not in self._contexts:
            self._contexts[gone] = self._sandbox.look_without(self._start, gone).context
            if len(self._contexts) > _KEPT:
                self._contexts.popitem(last=False)
        return self._contexts[gone]

    def seen(self, gone: Gone) -> Seen:
        """What a search for values needs of looks at that.

        Draws are the same whatever is gone. So values differ by what is gone, not by luck.
        """
        if gone not in self._seen:
            drawn = self._drawn(gone, (*_FIRST_SEEDS, *_FURTHER_SEEDS))
            contexts = list(itertools.islice(drawn, DRAWS))
            options = [options_of(context) for context in contexts]
            found = dict.fromkeys(k for one in options for k in one.choices if k is not None)
            holds = self._settle(gone, {k: tuple(best_hold(c, k) for c in contexts) for k in found}, drawn)
            left = MAX_PICKS - len(gone)
            prices = {k: price_of(p, left, k == TARGET_ID) for k, p in holds.items() if any(p)}
            target = prices.pop(TARGET_ID, None)
            self._seen[gone] = Seen(prices, target, options[0].outlook)
        return self._seen[gone]

    def price(self, gone: Gone, object_id: int) -> Price:
        """What an object takes by the further draws alone, which may have a grasp where those of `seen` have none."""
        holds = self._further_holds(gone, object_id, self._drawn(gone, _FURTHER_SEEDS))
        return price_of(holds, MAX_PICKS - len(gone), object_id == TARGET_ID) if any(holds) else NEVER

    def context_and_truth(self, gone: Gone) -> tuple[PlanningContext, Truth]:
        """The look, taken anew, and what is so then."""
        context = self._sandbox.look_without(self._start, gone).context
        return context, self._sandbox.truth(self._sandbox.now(self._start))

    def _settle(
        self, gone: Gone, holds: Mapping[int, Holds], further: Iterator[PlanningContext]
    ) -> dict[int, Holds]:
        """p(hold) of each object in further draws alone, where the first ones leave it in doubt: an order that counts
        on lucky draws would look better than it is. Where the first draws give an object the same p(hold) as at
        another look, further ones are taken to do so, too.
        """
        doubtful = {k: p for k, p in holds.items() if k == TARGET_ID or min(p) < _SURE}
        for k, p in doubtful.items():
            if (k, p) not in self._settled:
                self._settled[k, p] = self._further_holds(gone, k, further)
        return {k: self._settled.get((k, p), p) if k in doubtful else p for k, p in holds.items()}

    def _further_holds(self, gone: Gone, object_id: int, further: Iterator[PlanningContext]) -> Holds:
        if gone not in self._more:
            self._more[gone] = [{k: best_hold(c, k) for k in c.scene.ids} for c in further]
        return tuple(holds.get(object_id, 0.0) for holds in self._more[gone])

    def _drawn(self, gone: Gone, seeds: Iterable[int]) -> Iterator[PlanningContext]:
        return (look.context for look in self._sandbox.looks_without(self._start, gone, seeds))
