"""The planners on each shipped set of problems apart: what all sets together say may hold on none of them."""

from collections.abc import Sequence
from dataclasses import replace

from torc.benchmark.comparison import compare
from torc.benchmark.measures import COST, DROP_FREE, SUCCESS
from torc.benchmark.report.cells import TextTable, signed_text
from torc.benchmark.rows import Table
from torc.problems.sets import set_of


def sets_table(table: Table, planners: Sequence[str], best: str | None) -> TextTable:
    """A row per set and planner, none where all are of one set. `best` is whom the others are compared with."""
    rows = []
    sets = {problem: set_of(problem) or "others" for problem in table.problems}
    names = sorted(set(sets.values()))
    for name in names if len(names) > 1 else ():
        part = replace(table, rows=tuple(r for r in table.rows if sets[r.problem] == name))
        for planner in planners:
            if done := part.completed(planner):
                more = "" if best in (None, planner) else signed_text(compare(part, planner, best).cost, 2)
                cost, *shares = (m.of(done).text(m.digits) for m in (COST, SUCCESS, DROP_FREE))
                rows.append((name, planner, str(len(done)), cost, more, *shares))
    against = f"more than {best or 'the best'}"
    header = ("set", "planner", "trials", "picks to retrieval", against, "retrieved", "with no drop")
    note = "More: on the same problems and seeds. Brackets: 95 % intervals over the problems of the set."
    return TextTable("Set by set", header, rows, note)
