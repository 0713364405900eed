"""Price a pick: the expected picks until a grasp of an object holds, from looks with freshly drawn grasps.

Because grasps are drawn, an object has a good grasp at some looks and none at others. So p(hold) is a mean over looks,
0 where a look finds none: such a pick is wasted. A failed try at the target may lose it, and with it all remaining
picks (`torc.task_planning.belief.costs`).

The interval of a price covers an error of p(hold) and the small number of looks. CALIBRATION_ERROR is the grasp model's
difference between promised and delivered (results/grasp-model/README.md), rounded up.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from torc import PlanningContext
from torc.oracle.solve import MAX_PICKS, best_hold, options_of
from torc.pipeline.better_bet import BetConfig
from torc.records import TARGET_ID

CALIBRATION_ERROR = 0.03
_ERRORS = (-CALIBRATION_ERROR, CALIBRATION_ERROR)
_LEAST_P = 0.05
_SIGNS = 1.96
"""Standard errors on either side in a 95 % interval."""


@dataclass(frozen=True)
class Price:
    """Expected picks, with the interval that an error of p(hold) allows."""

    mean: float = 0.0
    low: float = 0.0
    high: float = 0.0

    def __add__(self, other: "Price") -> "Price":
        return Price(self.mean + other.mean, self.low + other.low, self.high + other.high)


NEVER = Price(float(MAX_PICKS), float(MAX_PICKS), float(MAX_PICKS))


def price_of(holds: Sequence[float], picks_left: int, is_target: bool = False) -> Price:
    """Price an object by the p(hold) of its best grasp at each of some looks, 0 where it has none."""
    p = np.asarray(holds, dtype=float)
    lost_share = BetConfig().lost_share if is_target else 0.0
    lost = lost_share * float(np.where(p > 0, 1.0 - p, 0.0).mean())
    error = CALIBRATION_ERROR
    if len(p) > 1:
        error += _SIGNS * float(p.std(ddof=1)) / len(p) ** 0.5

    def picks(change: float) -> float:
        comes = min(max(float(p.mean()) + change, _LEAST_P), 1.0)
        goes = min(max(lost - lost_share * change, 0.0), 1.0 - comes)
        return min((1 + goes * picks_left) / (comes + goes), float(MAX_PICKS))

    return Price(picks(0.0), picks(error), picks(-error))


@dataclass(frozen=True)
class Try:
    """The first try at an object, whose grasp is known and holds with probability p.

    A failed one loses the target with probability lost_share, and with it all remaining picks.
    """

    p: float
    lost_share: float = 0.0
    picks_left: int = MAX_PICKS

    def then(self, after: Price, otherwise: Price) -> Price:
        """Price the choice, given what follows if the object is out, and if it is not."""
        tries = [Try(min(max(self.p + d, 0.0), 1.0), self.lost_share, self.picks_left) for d in _ERRORS]
        low = min(t._picks(after.low, otherwise.low) for t in tries)
        high = max(t._picks(after.high, otherwise.high) for t in tries)
        return Price(self._picks(after.mean, otherwise.mean), low, high)

    def _picks(self, after: float, otherwise: float) -> float:
        failed = (1.0 - self.lost_share) * otherwise + self.lost_share * self.picks_left
        return 1.0 + self.p * after + (1.0 - self.p) * failed


def first_tries(context: PlanningContext) -> dict[int, Try]:
    """Return the first try at each object that can be picked at a look."""
    found: dict[int, Try] = {}
    for k in options_of(context).choices:
        if k is not None:
            lost = BetConfig().lost_share if k == TARGET_ID else 0.0
            found[k] = Try(best_hold(context, k), lost, context.picks_left)
    return found
