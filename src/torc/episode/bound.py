"""How sure it is that a reference's costs are the least: a mark that goes with its trials into every table."""

from enum import StrEnum


class Bound(StrEnum):
    """What is known of the picks and drops that a trial took."""

    PROVED = "proved"
    """No order of picks takes less."""
    LIKELY = "likely"
    """Every order that might take less, if a pick did nothing but take its object away, was tried and did not."""
    FOUND = "found"
    """The least that was found; others may take less."""
