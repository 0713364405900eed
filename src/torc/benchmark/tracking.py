"""A report in an experiment tracker, one run for each planner: MLflow, or Weights & Biases."""

from importlib import import_module
from typing import Any

from torc.benchmark.report.writing import Report
from torc.errors import InputError


def track(report: Report, where: str) -> None:
    """Log each planner's measures, and the report's page.

    Args:
        report: as `write_report` gave it.
        where: mlflow:EXPERIMENT or wandb:PROJECT. The trackers' own environment variables say where that is
            (MLFLOW_TRACKING_URI; WANDB_API_KEY, WANDB_MODE).

    Raises:
        InputError: another tracker, no name, or its library is not installed.
    """
    tracker, _, name = where.partition(":")
    if tracker not in ("mlflow", "wandb") or not name:
        raise InputError(f"{where!r} is no tracker. Write mlflow:EXPERIMENT or wandb:PROJECT.")
    try:
        library = import_module(tracker)
    except ImportError:
        raise InputError(f"{tracker} is not installed: pip install {tracker}") from None
    log = _log_to_mlflow if tracker == "mlflow" else _log_to_wandb
    log(library, name, report)


def _log_to_mlflow(mlflow: Any, experiment: str, report: Report) -> None:
    mlflow.set_experiment(experiment)
    for standing in report.summary["ranking"]:
        with mlflow.start_run(run_name=standing["planner"]):
            mlflow.log_params(_facts(standing))
            mlflow.log_metrics(_metrics(standing))
            mlflow.log_artifact(str(report.page))


def _log_to_wandb(wandb: Any, project: str, report: Report) -> None:
    for standing in report.summary["ranking"]:
        run = wandb.init(project=project, name=standing["planner"], config=_facts(standing))
        run.log(_metrics(standing))
        run.save(str(report.page), base_path=str(report.directory), policy="now")
        run.finish()


def _facts(standing: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in standing.items() if key != "measures"}


def _metrics(standing: dict[str, Any]) -> dict[str, float]:
    """Value and interval of every measure. MLflow wants no commas in names."""
    return {
        name.replace(",", "") + suffix: measure[key]
        for name, measure in standing["measures"].items()
        for key, suffix in (("value", ""), ("low", " low"), ("high", " high"))
        if measure[key] is not None
    }
