"""Measures reach the trackers: one run for each planner. Fakes stand for the libraries."""

import sys
from contextlib import nullcontext
from pathlib import Path
from unittest.mock import MagicMock

import pytest

from torc.benchmark.report.writing import Report
from torc.benchmark.tracking import track
from torc.errors import InputError

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
