"""Look at a problem without some of its objects; few contexts are kept, and what a search for values needs of them."""

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
"""Number of contexts: each holds a volume."""
DRAWS = 2
"""Looks at the same objects for the search, each with freshly drawn grasps."""
FURTHER_DRAWS = 8
"""Further looks for objects that the first ones leave in doubt."""
_FIRST_SEEDS = range(1, 1 + DRAWS)
_FURTHER_SEEDS = range(1 + DRAWS, 1 + DRAWS + FURTHER_DRAWS)
_SURE = 0.9
"""An object that holds this surely in all draws is not in doubt."""
Holds = tuple[float, ...]


class Looks:
    """Looks from a problem's beginning, taken again only if no longer kept. All methods raise PhysicsError."""

    def __init__(self, sandbox: Sandbox) -> None:
        """Take a sandbox, whose own draws are those of the contexts."""
        self._sandbox, self._start = sandbox, sandbox.begin()
        self._contexts: OrderedDict[Gone, PlanningContext] = OrderedDict()
        self._seen: dict[Gone, Seen] = {}
        self._settled: dict[tuple[int, Holds], Holds] = {}
        self._more: dict[Gone, list[dict[int, float]]] = {}

    def context(self, gone: Gone) -> PlanningContext:
        """Return what a planner sees when these objects were removed without a failure."""
        if gone not in self._contexts:
            self._contexts[gone] = self._sandbox.look_without(self._start, gone).context
            if len(self._contexts) > _KEPT:
                self._contexts.popitem(last=False)
        return self._contexts[gone]

    def seen(self, gone: Gone) -> Seen:
        """Return what a search for values needs of looks without these objects.

        Draws are the same whatever is gone, so that values differ by what is gone, not by luck.
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
        """Price an object by the further draws alone, which may have a grasp where those of `seen` have none."""
        holds = self._further_holds(gone, object_id, self._drawn(gone, _FURTHER_SEEDS))
        return price_of(holds, MAX_PICKS - len(gone), object_id == TARGET_ID) if any(holds) else NEVER

    def context_and_truth(self, gone: Gone) -> tuple[PlanningContext, Truth]:
        """Return the look, taken anew, and the truth then."""
        context = self._sandbox.look_without(self._start, gone).context
        return context, self._sandbox.truth(self._sandbox.now(self._start))

    def _settle(
        self, gone: Gone, holds: Mapping[int, Holds], further: Iterator[PlanningContext]
    ) -> dict[int, Holds]:
        """Return p(hold) of each object, in further draws alone if the first ones leave it in doubt.

        Otherwise an order that counts on lucky draws would look better than it is. If the first draws give an object
        the same p(hold) as at another look, further ones are assumed to do so, too.
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
