"""A report in an experiment tracker, one run for each planner: MLflow, or Weights & Biases."""

from importlib import import_module
from typing import Any

from torc.benchmark.report.writing import Report
from torc.errors import InputError


def track(report: Report, where: str) -> None:
    """Log each planner's measures, and the report's page, to `where`: mlflow:EXPERIMENT or wandb:PROJECT.

    The trackers' own environment variables give the server (MLFLOW_TRACKING_URI; WANDB_API_KEY, WANDB_MODE). Raises
    InputError: another tracker, no name, or its library is not installed.
    """
    tracker, _, name = where.partition(":")
    if tracker not in ("mlflow", "wandb") or not name:
        raise InputError(f"{where!r} is no tracker. Write mlflow:EXPERIMENT or wandb:PROJECT.")
    try:
        library: Any = import_module(tracker)
    except ImportError:
        raise InputError(f"{tracker} is not installed: pip install {tracker}") from None
    if tracker == "mlflow":
        library.set_experiment(name)
    for standing in report.summary["ranking"]:
        planner = standing["planner"]
        metrics = {
            name.replace(",", "") + suffix: measure[key]  # MLflow allows no commas in names
            for name, measure in standing["measures"].items()
            for key, suffix in (("value", ""), ("low", " low"), ("high", " high"))
            if measure[key] is not None
        }
        facts = {key: value for key, value in standing.items() if key != "measures"}
        if tracker == "mlflow":
            with library.start_run(run_name=planner):
                library.log_params(facts)
                library.log_metrics(metrics)
                library.log_artifact(str(report.page))
        else:
            run = library.init(project=name, name=planner, config=facts)
            run.log(metrics)
            run.save(str(report.page), base_path=str(report.directory), policy="now")
            run.finish()
