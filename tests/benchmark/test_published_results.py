"""The published results can be read, and their pages show them."""

from pathlib import Path

import pytest

from torc.benchmark.reading import read_table
from torc.benchmark.report.ranking import rank
from torc.benchmark.report.tables import comparison_table, measures_table, promises_table
from torc.trials.recorded import read_trial
from torc.web.shelf import open_shelf

ROOT = Path(__file__).parents[2]
RESULTS = sorted(path.parent for path in (ROOT / "results").glob("*/trials.csv"))
SHOWN = "planner,scenes,trials,retrieved,with no drop,picks to retrieval,drops,median picks,mean picks,grasps held"
SHOWN += ",delivered,held of unseen kinds,delivered of unseen kinds"


@pytest.mark.long
@pytest.mark.parametrize("directory", RESULTS, ids=lambda path: path.name)
def test_the_page_of_a_set_shows_its_results(directory):
    table = read_table(directory)
    assert not table.left_out
    assert all(row.completed for row in table.rows)
    planners = [s.planner for s in rank(table)]
    measures = measures_table(table, planners)
    columns = [measures.header.index(name) for name in SHOWN.split(",")]
    page = (directory / "README.md").read_text()
    for row in measures.rows:
        assert "| " + " | ".join(str(row[i]) for i in columns) + " |" in page
    if directory.name == "torc40":
        for row in (*comparison_table(table, planners).rows, *promises_table(table, planners).rows):
            assert f"| {' | '.join(map(str, row))} |" in page


STORE = Path(__file__).parent / "store_of_0_1"


def test_its_trials_stand_in_a_table():
    rows = {row.planner: row for row in read_table(STORE).rows}
    assert set(rows) == {"random", "dg-select"}
    for row in rows.values():
        assert (row.problem, row.seed, row.status, row.conditions) == ("structured-04", 0, "completed", "")
        assert row.retrieved
        assert len(row.picked) == row.picks > 0
        assert row.participant
        assert all(0 < pick.p <= 1 for pick in row.picked)


def test_its_trials_can_be_looked_at():
    lines = open_shelf(STORE).lines()
    assert {line["planner"] for line in lines} == {"random", "dg-select"}
    trial = read_trial(next((STORE / "trials").glob("*dg-select*")))
    assert trial.spec.planner.name == "dg-select"
    assert trial.picks[0].decided.reason
