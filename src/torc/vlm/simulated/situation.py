"""The facts of a scene, true or believed by a model, and the object to pick that follows from them."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from torc.records import TARGET_ID

Pair = tuple[int, int]


@dataclass(frozen=True)
class Situation:
    """Facts about the objects of a scene; ids are the numbers in the marked image.

    Attributes:
        in_sight: visible pixels of the objects that carry a number in the image.
        graspable: objects in sight that have a valid grasp.
        lies_on: (upper, lower).
        hides: (front, back) -> how many pixels of the back object the front one hides.
        blocks: (blocker, blocked): the blocker is in the way of grasps of the other.
        near: pairs (lower id first) that meet in the image; a model can err on these.
    """

    in_sight: Mapping[int, int]
    graspable: frozenset[int]
    lies_on: frozenset[Pair]
    hides: Mapping[Pair, int]
    blocks: frozenset[Pair]
    near: frozenset[Pair]

    @property
    def target_seen(self) -> bool:
        return TARGET_ID in self.in_sight

    def waits_for(self, k: int) -> tuple[int, ...]:
        """Return what has to go before an object, most urgent first; empty for one that can be picked.

        First the objects that lie on it; then, if it cannot be grasped, those that block its grasps and those that hide
        it, the largest hidden part first.
        """
        on_top = sorted(upper for upper, lower in self.lies_on if lower == k)
        if on_top or k in self.graspable:
            return tuple(on_top)
        largest_first = sorted(self.hides.items(), key=lambda item: (-item[1], item[0]))
        in_front = [front for (front, back), _ in largest_first if back == k]
        blockers = sorted(a for a, b in self.blocks if b == k)
        # Of the blockers, first those that also stand in front of it.
        order = [f for f in in_front if f in blockers] + [b for b in blockers if b not in in_front] + in_front
        return tuple(dict.fromkeys(order))

    def removal_order(self, target: int = TARGET_ID) -> tuple[int, ...]:
        """Return a sequence of objects to pick that ends with the target, by these facts alone.

        It follows what each object waits for until something can be picked. If that leads nowhere, it begins with the
        graspable object that hides the most, if possible one that nothing lies on. Empty if nothing is in sight.
        """
        found = self._way_to(target, set())
        if found:
            return found
        covered = {lower for _, lower in self.lies_on}
        free = sorted(self.graspable - covered) or sorted(self.graspable) or sorted(self.in_sight)
        if not free:
            return ()
        extent: Counter[int] = Counter()
        for (front, _), pixels in self.hides.items():
            extent[front] += pixels
        first = max(free, key=lambda k: (extent[k], self.in_sight.get(k, 0), -k))
        return (first,) if first == target else (first, target)

    def _way_to(self, k: int, tried: set[int]) -> tuple[int, ...]:
        """Return a way from something that can be picked to k; empty if every way was tried."""
        tried.add(k)
        waits_for = self.waits_for(k)
        if not waits_for:
            return (k,) if k in self.graspable else ()
        for first in waits_for:
            way = self._way_to(first, tried) if first not in tried else ()
            if way:
                return (*way, k)
        return ()
