"""What a trial's model took, from its result.json, which may be a stranger's."""

from collections.abc import Mapping
from math import isfinite
from typing import Any

_COUNTS = {"vlm_calls": "calls", "tokens_sent": "tokens_sent", "tokens_written": "tokens_written"}
_MAX_CURRENCY = 8


def vlm_facts(told: Any) -> dict[str, Any]:
    """Fields of `TrialRow` from the entry `vlm_use`; none where there is no such entry."""
    if not isinstance(told, Mapping):
        return {}
    facts: dict[str, Any] = {}
    for name, entry in _COUNTS.items():
        count = told.get(entry)
        facts[name] = count if type(count) is int and count >= 0 else None
    cost, currency = told.get("cost"), told.get("currency")
    number = float(cost) if isinstance(cost, int | float) and not isinstance(cost, bool) else -1.0
    facts["vlm_cost"] = number if isfinite(number) and number >= 0 else None
    return facts | {"currency": currency[:_MAX_CURRENCY] if isinstance(currency, str) else ""}
