"""What a report leaves as tables tells another report the same."""

import csv
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from unittest.mock import MagicMock

import pytest

from torc.benchmark.reading import read_table, read_tables
from torc.benchmark.report.ranking import rank
from torc.benchmark.report.writing import Report, track
from torc.benchmark.rows import PICKS_FILE, TRIALS_FILE, read_rows, write_tables
from torc.errors import InputError


@pytest.fixture
def kept(played, tmp_path):
    """The tables alone."""
    write_tables(read_table(played), tmp_path)
    return tmp_path


def _plain(table):
    return [replace(r, directory=r.directory.relative_to(table.root)) for r in table.rows]


def test_tables_are_read_as_they_were_written(played, kept):
    again, before = read_table(kept), read_table(played)
    assert _plain(again) == _plain(before)
    assert rank(again) == rank(before)


def test_of_older_tables_the_name_tells_who_was_a_reference(kept):
    def older(row):
        assert row.pop("participant") == str("human" not in row["planner"])
        return {**row, "planner": row["planner"].replace("dg-select", "oracle")}

    _rewritten(kept / TRIALS_FILE, older)
    references = {row.planner for row in read_rows(kept) if not row.participant}
    assert references == {"oracle", "human anna (outside view)"}


def test_several_directories_are_one_table(played, kept):
    both = read_tables([played, kept])
    missing = [row for row in both.rows if row.status == "missing"]  # nothing is said of these
    assert len(both.rows) == len(both.left_out) + len(missing) == len(read_table(played).rows)
    assert all(r.directory.is_relative_to(both.root) for r in both.rows)
    text = (kept / TRIALS_FILE).read_text()
    (kept / TRIALS_FILE).write_text(text.replace("dg-select", "other"))
    assert set(read_tables([played, kept]).planners) == {*read_table(played).planners, "other"}


def _rewritten(path, change):
    with open(path, newline="", encoding="utf-8") as f:
        records = list(csv.DictReader(f))
    records = [change(record) for record in records]
    with open(path, "w", newline="", encoding="utf-8") as f:
        writer = csv.DictWriter(f, list(records[0]))
        writer.writeheader()
        writer.writerows(records)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        (TRIALS_FILE, lambda r: {**r, "directory": "/etc"}),
        (TRIALS_FILE, lambda r: {**r, "directory": "a/../../b"}),
        (TRIALS_FILE, lambda r: {**r, "picks": "1e999"}),
        (PICKS_FILE, lambda r: {**r, "result": "flown"}),
        (PICKS_FILE, lambda r: {k: v for k, v in r.items() if k != "planner"}),
    ],
    ids=["absolute", "upwards", "no number", "unknown result", "whose"],
)
def test_tables_of_strangers_are_refused_where_they_are_wrong(kept, name, change):
    _rewritten(kept / name, change)
    with pytest.raises(InputError, match=name):
        read_table(kept)


MEASURE = {"value": 0.2, "low": 0.1, "high": None, "count": 3, "problems": 1}
RANKING = [{"planner": name, "played": 3, "measures": {"decision, s": MEASURE}} for name in ("one", "two")]
METRICS = {"decision s": 0.2, "decision s low": 0.1}


@pytest.fixture
def report(tmp_path: Path) -> Report:
    return Report(tmp_path, tmp_path / "index.html", "", {"ranking": RANKING})


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> MagicMock:
    fake = MagicMock()
    fake.start_run.return_value = nullcontext()
    for name in ("mlflow", "wandb"):
        monkeypatch.setitem(sys.modules, name, fake)
    return fake


def test_each_planner_gets_a_run(report: Report, library: MagicMock) -> None:
    track(report, "mlflow:clutter")
    library.set_experiment.assert_called_once_with("clutter")
    assert [call.kwargs["run_name"] for call in library.start_run.call_args_list] == ["one", "two"]
    library.log_params.assert_any_call({"planner": "two", "played": 3})
    library.log_metrics.assert_called_with(METRICS)
    track(report, "wandb:clutter")
    assert [call.kwargs["name"] for call in library.init.call_args_list] == ["one", "two"]
    library.init.return_value.log.assert_called_with(METRICS)


@pytest.mark.parametrize(
    ("where", "words"),
    [("excel:sheet", "mlflow:EXPERIMENT"), ("mlflow:", "no tracker"), ("wandb:x", "pip install wandb")],
)
def test_trackers_that_are_not_there_are_refused(
    report: Report, where: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "wandb", None)
    with pytest.raises(InputError, match=words):
        track(report, where)
