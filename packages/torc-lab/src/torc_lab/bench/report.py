"""Report trials on a real robot beside simulated ones and the paper's, and which differences they can show."""

import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from math import comb

from scipy.stats import fisher_exact

from torc import Table
from torc.benchmark.intervals import ALPHA, LEVEL
from torc.benchmark.measures import COST, DROP_FREE, DROPS, SUCCESS
from torc.benchmark.paper import (
    REAL_CITATION,
    REAL_METHODS,
    REAL_SCENES,
    REAL_TRIALS,
    PaperMethod,
    method_name,
    paper_method,
)
from torc.benchmark.report.cells import Cell, TextTable
from torc.benchmark.report.pages import Block, Section
from torc.benchmark.report.tables import comparison_table
from torc.benchmark.rows import TrialRow
from torc.io.reading import read_text

_HEADER = (
    "planner",
    "trials of",
    "scenes",
    "trials",
    "retrieved",
    "with no drop",
    "picks to retrieval",
    "drops",
)


def real_sections(table: Table) -> list[Section]:
    """Return the report's sections on trials on a robot; empty if none was completed."""
    real = table.on_robot
    if not any(row.completed for row in real.rows):
        return []
    beside = side_by_side(table, real)
    # Where all trials are real, the report compares planners anyway.
    pairs = comparison_table(real, real.planners) if table.beside else None
    told: list[Block] = [*([pairs] if pairs and pairs.rows else []), *separable(real)]
    return [
        Section(beside.title, [beside, *_layouts(real.rows)], "robot"),
        Section("What the trials on the robot can tell apart", told),
    ]


def side_by_side(table: Table, real: Table) -> TextTable:
    """Return a table with a row per planner and kind of trials, including the methods of the paper's robot."""
    rows: list[Sequence[Cell]] = []
    simulated = Table(table.root, tuple(row for row in table.rows if not row.real))
    played = {method_name(planner) for planner in real.planners}
    for planner in (*real.planners, *(name for name in REAL_METHODS if name not in played)):
        for told, of in (("real robot", real), ("simulation", simulated)):
            if done := of.completed(planner):
                rows.append((planner, told, *_counted(done)))
        if method := paper_method(planner, real=True):
            rows.append(
                (planner, "the paper's robot", f"{REAL_SCENES}", f"{REAL_TRIALS}", *_published(method))
            )
        if method := paper_method(planner):
            shares = f"{method.success:.2f}", f"{method.drop_free:.2f}"
            rows.append((planner, "the paper's simulation", "40", "", *shares, "", ""))
    note = (
        "Retrieved, with no drop: how many of the trials, and the share; drops: mean number of other objects that fell "
        "off the table, told by the operator on a real robot. Brackets: 95 % intervals over scenes or problems. The "
        "scenes of each kind are other ones: that a planner does better in one row than in another need not be its "
        f"merit. The paper gives no numbers of picks and drops for its robot. {REAL_CITATION}."
    )
    return TextTable("On a real robot", _HEADER, rows, note)


def _counted(done: Sequence[TrialRow]) -> tuple[str, ...]:
    got, clean = sum(r.retrieved for r in done), sum(r.retrieved and r.drops == 0 for r in done)
    return (
        str(len({r.problem for r in done})),
        str(len(done)),
        f"{got} of {len(done)}: {SUCCESS.of(done).text()}",
        f"{clean} of {len(done)}: {DROP_FREE.of(done).text()}",
        COST.of(done).text(1),
        DROPS.of(done).text(),
    )


def _published(method: PaperMethod) -> tuple[str, ...]:
    told = [
        f"{round(share * REAL_TRIALS)} of {REAL_TRIALS}: {share:.2f}"
        for share in (method.success, method.drop_free)
    ]
    return *told, "", ""


def separable(real: Table) -> list[str]:
    """Return, in words, which differences this number of trials can show, whatever the outcomes are."""
    planners = [p for p in real.planners if real.completed(p)]
    if len(planners) < 2:
        return ["There is only one planner on the robot: nothing to tell apart."]
    shared = set.intersection(*({r.problem for r in real.completed(p)} for p in planners))
    scenes, pairs = len(shared), comb(len(planners), 2)
    least, needed = least_p(scenes, pairs), scenes_needed(pairs)
    told = f"By picks to retrieval, paired by scene ({_some(scenes, 'scene')}, {_some(pairs, 'pair')} of planners): "
    if least >= ALPHA:
        told += (
            f"the permutation test cannot give a p below {least:.2g}, however large the difference is. These trials "
            f"can therefore call no planner better than another. At least {needed} scenes are needed for that, in all "
            "of which the same one is better; more trials of the same scenes do not help."
        )
    else:
        told += (
            f"a p can get as low as {least:.2g}. A planner can be called better than another, if it is so in nearly "
            "every scene."
        )
    trials = min(len(real.completed(p)) for p in planners)
    fewer = successes_apart(trials)
    alone = f"As trials of these scenes alone, each taken as independent, {trials} against {trials} "
    if fewer is None:
        alone += "never tell two success rates apart (Fisher's exact test)."
    else:
        alone += (
            f"tell success rates apart at best from {trials} of {trials} against {fewer} of {trials} on (Fisher's "
            "exact test, p below .05). Smaller differences stay open."
        )
    none = 1 - ((1 - LEVEL) / 2) ** (1 / trials)
    rare = (
        f"What never happened in {trials} independent trials, a failure or a drop, may still happen in up to "
        f"{none:.0%} of them. The paper's own {REAL_TRIALS} trials of each method (8 or 9 retrieved) tell none of its "
        "methods apart either."
    )
    return [told, alone, rare]


def least_p(scenes: int, pairs: int) -> float:
    """Return the least p that the permutation test over scenes can give, corrected for the number of pairs (Holm).

    All signs alike are 2 of the 2^n assignments.
    """
    return min(1.0, pairs * 2.0 ** (1 - scenes)) if scenes else 1.0


def scenes_needed(pairs: int) -> int:
    """Return the least number of scenes that can make a difference significant."""
    return next(n for n in range(1, 100) if least_p(n, pairs) < ALPHA)


def successes_apart(trials: int) -> int | None:
    """Return the most successes in `trials` that differ significantly from success in all; None if no number does."""
    for fewer in range(trials - 1, -1, -1):
        if fisher_exact([[trials, 0], [fewer, trials - fewer]]).pvalue < ALPHA:
            return fewer
    return None


def _some(count: int, what: str) -> str:
    return f"{count} {what}" + ("" if count == 1 else "s")


def _layouts(rows: Sequence[TrialRow]) -> Iterator[str]:
    """Yield a line on how the scenes' layouts were accepted, from those trials that can be read."""
    found = []
    for row in rows:
        with suppress(OSError, ValueError, KeyError, TypeError):
            layout = json.loads(read_text(row.directory / "result.json"))["layout"]
            found += [layout] if row.completed and isinstance(layout, dict) else []
    if found:
        by_word = sum(layout.get("accepted_by") == "word" for layout in found)
        yield (
            f"Laid out by the overlap of every object: {len(found) - by_word} of {len(found)} trials; by the "
            f"operator's word: {by_word}."
        )
