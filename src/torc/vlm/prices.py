"""Prices of tokens as the user states them; torc knows none."""

import math
from dataclasses import dataclass

from torc.errors import InputError


@dataclass(frozen=True)
class Prices:
    """Prices of a million tokens sent, and of a million written (thinking included)."""

    sent: float
    written: float
    currency: str = "USD"

    def __post_init__(self) -> None:
        for price in (self.sent, self.written):
            if not (math.isfinite(price) and price >= 0):
                raise InputError(f"A price of {price} for a million tokens is none; it must be at least 0.")
        if not (self.currency.isalpha() and self.currency.isascii() and len(self.currency) <= 8):
            raise InputError(f"'{self.currency}' is no currency: write letters alone, e.g. USD or EUR.")

    def cost(self, sent: int, written: int) -> float:
        """Return the price of these numbers of tokens."""
        return (sent * self.sent + written * self.written) / 1_000_000
