"""The results in the repository can be read, and are those that the documentation shows."""

from pathlib import Path

import pytest

from torc.benchmark.reading import read_table
from torc.benchmark.report.ranking import rank
from torc.benchmark.report.tables import comparison_table, measures_table, promises_table

ROOT = Path(__file__).parents[2]
RESULTS = sorted(path.parent for path in (ROOT / "results").glob("*/trials.csv"))
SHOWN = "planner,scenes,trials,retrieved,with no drop,picks to retrieval,drops,median picks,mean picks,grasps held"
SHOWN += ",delivered,held of unseen kinds,delivered of unseen kinds"


@pytest.mark.parametrize("directory", RESULTS, ids=lambda path: path.name)
def test_the_page_of_a_set_shows_its_results(directory):
    table = read_table(directory)
    assert not table.left_out
    assert all(row.completed for row in table.rows)
    planners = [s.planner for s in rank(table)]
    measures = measures_table(table, planners)
    columns = [measures.header.index(name) for name in SHOWN.split(",")]
    page = (ROOT / "docs" / f"{directory.name}.md").read_text()
    for row in measures.rows:
        assert "| " + " | ".join(str(row[i]) for i in columns) + " |" in page
    if directory.name == "torc40":
        for row in (*comparison_table(table, planners).rows, *promises_table(table, planners).rows):
            assert f"| {' | '.join(map(str, row))} |" in page
