"""What a pick takes: the expected number of picks until a grasp of an object holds, from looks whose grasps are drawn
anew.

At some looks an object has a good grasp and at others none, because grasps are drawn. So p(hold) is a mean over looks,
0 where a look finds none: such a pick is wasted. A failed try at the target may lose it, and with it all picks that are
left (`torc.task_planning.expected_picks`).

The interval of a price allows for an error of p(hold): CALIBRATION_ERROR, which is the difference between promised and
delivered of the grasp model with masks and depth (docs/grasp_model.md), rounded up, and what so few looks may be off.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from torc.episode.ideal import MAX_PICKS, best_hold
from torc.episode.oracle.solve import options_of
from torc.pipeline.better_bet import BetConfig
from torc.records import TARGET_ID, PlanningContext

CALIBRATION_ERROR = 0.03
_LEAST_P = 0.05
_SIGNS = 1.96
"""Standard errors on either side in a 95 % interval."""


@dataclass(frozen=True)
class Price:
    """Expected picks, and the least and most if p(hold) is off."""

    mean: float = 0.0
    low: float = 0.0
    high: float = 0.0

    def __add__(self, other: "Price") -> "Price":
        return Price(self.mean + other.mean, self.low + other.low, self.high + other.high)


NEVER = Price(float(MAX_PICKS), float(MAX_PICKS), float(MAX_PICKS))


def price_of(holds: Sequence[float], picks_left: int, is_target: bool = False) -> Price:
    """The price of an object, from the p(hold) of its best grasp at each of some looks, 0 where it has none."""
    p = np.asarray(holds, dtype=float)
    lost_share = BetConfig().lost_share if is_target else 0.0
    lost = lost_share * float(np.where(p > 0, 1.0 - p, 0.0).mean())
    error = CALIBRATION_ERROR
    if len(p) > 1:
        error += _SIGNS * float(p.std(ddof=1)) / len(p) ** 0.5

    def picks(change: float) -> float:
        comes = min(max(float(p.mean()) + change, _LEAST_P), 1.0)
        goes = min(max(lost - lost_share * change, 0.0), 1.0 - comes)
        return min((1.0 + goes * picks_left) / (comes + goes), float(MAX_PICKS))

    return Price(picks(0.0), picks(error), picks(-error))


def first_prices(context: PlanningContext, again: Mapping[int, Price]) -> dict[int, Price]:
    """What each choice takes at the look that is shown: the grasp of the first try is known, those of further ones are
    not, which cost what they take at any look, and all picks that there are where no other look finds a grasp.
    """
    found: dict[int, Price] = {}
    for k in options_of(context).choices:
        if k is not None:
            lost = BetConfig().lost_share if k == TARGET_ID else 0.0
            p, rest = best_hold(context, k), again.get(k, NEVER)
            tries = ((p, rest.mean), (p + CALIBRATION_ERROR, rest.low), (p - CALIBRATION_ERROR, rest.high))
            found[k] = Price(*(_first_try(q, most, lost, context.picks_left) for q, most in tries))
    return found


def _first_try(p: float, rest: float, lost_share: float, picks_left: int) -> float:
    """Picks, where a failed try either leads to `rest` or loses all that are left."""
    p = min(max(p, 0.0), 1.0)
    return min(1 + (1 - p) * ((1 - lost_share) * rest + lost_share * picks_left), float(MAX_PICKS))
