"""A store that torc 0.1 wrote is still read, by the report and by the viewer."""

from pathlib import Path

from torc.benchmark.reading import read_table
from torc.episode.recorded import read_trial
from torc.web.shelf import open_shelf

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
