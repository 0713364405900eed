"""How certain it is that a reference's costs are the least; recorded with its trials and shown in every table."""

from enum import StrEnum


class Bound(StrEnum):
    """How good the picks and drops of a trial are known to be."""

    PROVED = "proved"
    """No order of picks takes less."""
    LIKELY = "likely"
    """Every order that might take less, if a pick only took its object away, was tried and took no less."""
    FOUND = "found"
    """The least found so far; another order may take less."""
