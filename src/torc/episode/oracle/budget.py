"""How much an oracle may try. Counted, not timed: the same budget gives the same answer on a busy machine."""

from torc.errors import InputError

LOOK_COST = 0.5
"""What a look, real or rough, takes of a budget that is counted in picks: about its share of the computing."""
DEFAULT_BUDGET = 80.0
"""In simulated picks: some 40 seconds of one 2 GHz core, where all of it is needed. Proves most answers of up to three
picks."""


def check_budget(budget: float) -> None:
    """Raises InputError for a budget that is no number or does not allow for a single look."""
    if not LOOK_COST <= budget < float("inf"):
        raise InputError(
            f"The budget is {budget:g}; it must be a number of simulated picks, e.g. {DEFAULT_BUDGET:g}."
        )
