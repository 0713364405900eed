"""Numbers and endings in words, as they stand in the cells of the report's tables."""

import numpy as np

from torc.benchmark.intervals import Estimate
from torc.benchmark.rows import TrialRow


def signed_text(found: Estimate, digits: int) -> str:
    """A difference with its interval, signs and all; empty where there is none."""
    if not np.isfinite(found.value):
        return ""
    low, high = (f"{v:+.{digits}f}" if np.isfinite(v) else "?" for v in (found.low, found.high))
    return f"{found.value:+.{digits}f} [{low}, {high}]"


def seconds_text(found: Estimate) -> str:
    """The value alone, in two significant digits."""
    value = found.value
    if not np.isfinite(value):
        return ""
    return f"{value:.2g}" if value < 100 else f"{value:.0f}"


def p_text(p: float, is_a_bound: bool) -> str:
    """A p-value in two significant digits; `is_a_bound`: it is known only to be less."""
    return ("< " if is_a_bound else "") + f"{p:.2g}"


def outcome(row: TrialRow) -> str:
    """How a trial ended."""
    if not row.completed:
        return row.status
    return "retrieved" if row.retrieved else f"not retrieved: {row.end}"


def first_line(text: str) -> str:
    """The first line that says something, cut to 200 characters."""
    line = next((x for x in text.splitlines() if x.strip()), "")
    return line if len(line) <= 200 else f"{line[:197]}..."
