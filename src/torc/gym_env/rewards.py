"""What a pick is worth, by the objectives of the paper: first few picks, then few drops."""

from dataclasses import dataclass

from torc.episode.state import EndReason
from torc.errors import InputError
from torc.records import PickOutcome


@dataclass(frozen=True)
class RewardConfig:
    """What counts how much.

    Attributes:
        pick_cost: of each attempt, failed ones included, and of each attempt that is left when an episode ends without
            the target: to lose the target is no way to save picks.
        drop_cost: of each object that falls off the table. Small against pick_cost: the paper's second objective.
        retrieval_bonus: for the target.

    Raises InputError for a negative number.
    """

    pick_cost: float = 1.0
    drop_cost: float = 0.2
    retrieval_bonus: float = 10.0

    def __post_init__(self) -> None:
        if not (self.pick_cost >= 0 and self.drop_cost >= 0 and self.retrieval_bonus >= 0):
            raise InputError(
                "pick_cost, drop_cost and retrieval_bonus must be at least 0; costs are subtracted."
            )


def reward(config: RewardConfig, outcome: PickOutcome, end: EndReason | None, picks_left: int) -> float:
    """Of one pick; `end` tells whether and why the episode ended with it, with so many attempts left."""
    value = -config.pick_cost - config.drop_cost * len(outcome.dropped)
    if end is EndReason.RETRIEVED:
        return value + config.retrieval_bonus
    return value if end is None else value - config.pick_cost * picks_left
