"""Answers of the oracle that nobody sought."""

from torc.episode.oracle.answer import ForeseenPick, OracleAnswer
from torc.records import TARGET_ID, PickOutcome, PickResult


def answer_for(problem, ids, proved=True):
    """An answer that picks these objects; the last is the target."""
    names = [placement.name for placement in problem.ordered()]
    results = {True: PickResult.RETRIEVED, False: PickResult.REMOVED}
    foreseen = tuple(
        ForeseenPick(i, names[i], PickOutcome(results[i == TARGET_ID], i, i, True, True), "") for i in ids
    )
    bound = len(ids) if proved else len(ids) - 1
    return OracleAnswer(problem.name, 0, 24.0, True, foreseen, 0, proved, bound, bound, 6, 12)
