"""What the models took that planners asked: calls, tokens, cost."""

from collections.abc import Sequence

from torc.benchmark.report.cells import TextTable
from torc.benchmark.rows import Table, TrialRow

_HEADER = (
    "planner",
    "trials",
    "calls a trial",
    "calls a pick",
    "tokens sent a trial",
    "tokens written a trial",
    "cost a trial",
    "cost in all",
)
_NOTE = (
    "Means over all trials in which the model was asked, errored ones too; tokens as the server counts them, thinking "
    "included in what is written; cost by the prices that were given with the run. Empty: a reply did not tell its "
    "tokens, or no prices were given. Replies from a cache count as when they were recorded."
)


def vlm_table(table: Table, planners: Sequence[str]) -> TextTable:
    """A row per planner that asked a model."""
    rows = []
    for planner in planners:
        asked = [row for row in table.of(planner) if row.vlm_calls is not None]
        if asked:
            rows.append((planner, str(len(asked)), *_cells(asked)))
    return TextTable("What the models took", _HEADER, rows, _NOTE)


def _cells(rows: Sequence[TrialRow]) -> tuple[str, ...]:
    calls = [row.vlm_calls or 0 for row in rows]
    picks = sum(row.picks for row in rows if row.completed)
    of_completed = sum(row.vlm_calls or 0 for row in rows if row.completed)
    currencies = {row.currency for row in rows}
    costs = _known([row.vlm_cost for row in rows]) if len(currencies) == 1 else None
    unit = "".join(currencies)
    return (
        f"{sum(calls) / len(rows):.1f}",
        f"{of_completed / picks:.2f}" if picks else "",
        *(_mean(_known([getattr(r, name) for r in rows])) for name in ("tokens_sent", "tokens_written")),
        "" if costs is None else f"{sum(costs) / len(costs):.4g} {unit}",
        "" if costs is None else f"{sum(costs):.4g} {unit}",
    )


def _known(values: Sequence[float | None]) -> list[float] | None:
    """The values; None where one is not known: a sum without it would be too small."""
    found = [v for v in values if v is not None]
    return found if len(found) == len(values) else None


def _mean(values: list[float] | None) -> str:
    return "" if values is None else f"{sum(values) / len(values):,.0f}"
