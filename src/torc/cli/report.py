"""`torc report`: which planner is best."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from torc.cli.printing import print_json, printable
from torc.errors import InputError


@dataclass(frozen=True)
class ReportCommand:
    """Say which planner to use, from the trials of `torc bench` (or any directory with trials in it).

    Writes one HTML page that needs nothing from outside, the same as Markdown, figures as SVG and PNG, and tables of
    all trials and picks as CSV (and Parquet, with the extra 'report'). Trials of `torc human` below the directory join
    the table as rows of their own.

      torc report runs/mine
      torc report results/torc40 runs/mine --out runs/both   # beside published ones

    Exit code 0 when the report was written, 2 when there is nothing to report on.
    """

    directories: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="DIRECTORY...")]
    """What was given to `torc bench --out`, or a directory with trials anywhere in it, or with the CSV tables of an
    earlier report. Of several all trials count together."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Where the report is written; DIRECTORY/report if not given."""
    gallery: int = 24
    """Failed trials that are shown in pictures, at most."""
    track: Annotated[str | None, tyro.conf.arg(metavar="TRACKER:NAME")] = None
    """Also log each planner's measures to an experiment tracker: mlflow:EXPERIMENT or wandb:PROJECT."""
    open: bool = False
    """Open the page in the browser."""
    json: Annotated[bool, tyro.conf.arg(help="Print answer, ranking and measures as JSON.")] = False

    def run(self) -> int:
        import webbrowser

        from torc.benchmark.report.writing import track, write_report
        from torc.trials.viewer_links import REPORT

        if self.gallery < 0:
            raise InputError("--gallery must be at least 0.")
        if not self.directories:
            raise InputError("Name a directory: what was given to `torc bench --out`.")
        if self.out is None and len(self.directories) > 1:
            raise InputError("Name a directory for the report of several directories: --out DIR.")
        report = write_report(self.directories, self.out or self.directories[0] / REPORT.parent, self.gallery)
        if self.track is not None:
            track(report, self.track)
        if self.json:
            print_json({**report.summary, "page": str(report.page)})
        else:
            for line in (report.summary["answer"], *report.summary["warnings"]):
                print(printable(line))
            print(printable(f"The report: {report.page}"))
            if report.advice:
                print(printable(report.advice))
        if self.open:
            webbrowser.open(report.page.resolve().as_uri())
        return 0
