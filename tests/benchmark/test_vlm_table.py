"""What models took, from result.json to the report's table and back from its files."""

import csv
from pathlib import Path

import pytest

from torc.benchmark.report.tables import vlm_table
from torc.benchmark.rows import TRIALS_FILE, Table, TrialRow, read_rows, write_tables

USE = {"calls": 4, "tokens_sent": 4000, "tokens_written": 200, "cost": 0.006, "currency": "EUR"}


def _columns(use):
    names = {"vlm_calls": "calls", "vlm_cost": "cost"}
    names |= {name: name for name in ("tokens_sent", "tokens_written", "currency")}
    return {} if use is None else {column: use[name] for column, name in names.items()}


def row(planner, seed, use, status="completed", picks=2):
    facts = {"status": status, "picks": picks, "retrieved": True, **_columns(use)}
    return TrialRow("", Path("runs") / f"{planner}-{seed}", "boxes", "structured", planner, seed, **facts)


def table(*rows):
    return Table(Path("runs"), tuple(rows))


def test_a_planner_that_asked_has_means_and_the_whole_cost():
    more = {**USE, "calls": 6, "tokens_sent": 6000, "cost": 0.010}
    found = vlm_table(table(row("a", 0, USE), row("a", 1, more), row("b", 0, None)), ["a", "b"])
    assert found.rows == [
        ("a", "2", "5.0", "2.50", "5,000", "200", "0.008 EUR", "0.016 EUR"),
    ]


def test_an_errored_trial_costs_too_but_has_no_picks():
    found = vlm_table(table(row("a", 0, USE), row("a", 1, USE, "errored", 0)), ["a"])
    assert found.rows == [("a", "2", "4.0", "2.00", "4,000", "200", "0.006 EUR", "0.012 EUR")]


@pytest.mark.parametrize(
    "other",
    [{"tokens_sent": None, "cost": None}, {"cost": None}, {"currency": "USD"}],
)
def test_what_is_not_known_of_every_trial_is_left_empty(other):
    found = vlm_table(table(row("a", 0, USE), row("a", 1, {**USE, **other})), ["a"])
    assert found.rows[0][-2:] == ("", "")
    assert (found.rows[0][4] == "") == ("tokens_sent" in other)


def test_the_files_of_a_report_keep_it(tmp_path):
    rows = row("a", 0, USE), row("b", 0, None), row("c", 0, {**USE, "cost": None})
    write_tables(Table(Path("runs"), rows), tmp_path)
    with open(tmp_path / TRIALS_FILE, newline="") as file:
        assert "tokens_written" in next(csv.reader(file))
    names = ("vlm_calls", "tokens_sent", "tokens_written", "vlm_cost", "currency")
    for before, after in zip(rows, read_rows(tmp_path), strict=True):
        assert [getattr(before, n) for n in names] == [getattr(after, n) for n in names]
