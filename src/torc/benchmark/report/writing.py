"""From a directory of trials to a directory with the report."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from torc.benchmark import intervals
from torc.benchmark.measures import MEASURES
from torc.benchmark.paper import CITATION
from torc.benchmark.reading import read_tables
from torc.benchmark.report import content
from torc.benchmark.report.board import trial_board
from torc.benchmark.report.bounding import beaten_table, bound_summary, bounds_table
from torc.benchmark.report.common_ground import Ranking, rank_on_common_ground
from torc.benchmark.report.figures import draw_all
from torc.benchmark.report.gallery import failures
from torc.benchmark.report.links import address_of
from torc.benchmark.report.markdown import markdown_page
from torc.benchmark.report.page import Content, html_page
from torc.benchmark.rows import Table
from torc.benchmark.store import Store
from torc.benchmark.table_files import write_tables
from torc.errors import InputError

REPORT_FORMAT = "torc-report/1"
_FIGURES = "figures"
_PAPER_FIGURES = 4
_INTERVALS = (
    "Intervals: trials of one problem are alike, so that problems are the sample. Shares have Wilson's interval for "
    "the effective number of trials, means Student's t corrected for skewness (Hall), differences Student's t, medians "
    "Woodruff's interval; each with the number of problems less one as degrees of freedom. In simulations with 10 to "
    "40 problems they contain the truth in 93 to 97 % of the cases; the usual bootstrap over problems in 86 to 94 %."
)
_OBJECTIVE = (
    "Ranking: the paper's primary objective is the number of picks until the target is retrieved, its secondary one "
    "the number of objects dropped. A trial that never retrieved the target counts as its whole budget. Planners that "
    "a permutation test over problems cannot tell from the best one (p of .05 or more, corrected for the number of "
    "planners) are a tie; among these, one that certainly drops fewer objects is preferred."
)


@dataclass(frozen=True)
class Report:
    """What was written, and its gist.

    Attributes:
        directory: of the report.
        page: the HTML page.
        view_command: what makes its links to trials work; "" where it has none.
        summary: plain data: answer, ranking, measures.
    """

    directory: Path
    page: Path
    view_command: str
    summary: dict[str, Any]


def write_report(roots: Sequence[Path], out: Path, gallery: int = 24) -> Report:
    """Read the trials of some directories and write index.html, report.md, figures and tables.

    Args:
        roots: of benchmarks, or with trials anywhere in them, or with the tables of an earlier report.
        out: directory to write to.
        gallery: failed trials that are shown in pictures, at most.

    Raises:
        InputError: there are no trials, or the directory cannot be written.
        MissingDependencyError: matplotlib is not installed.
    """
    table = read_tables(roots)
    ranking = rank_on_common_ground(table)
    made = _content(table, ranking, gallery)
    try:
        (out / _FIGURES).mkdir(parents=True, exist_ok=True)
        for picture in (*made.paper_figures, *made.figures):
            picture.save(out / _FIGURES)
        write_tables(table, out)
        (out / "index.html").write_text(html_page(made), encoding="utf-8")
        (out / "report.md").write_text(markdown_page(made, _FIGURES), encoding="utf-8")
    except OSError as error:
        raise InputError(f"Cannot write to '{out}': {error.strerror}. Choose another --out.") from error
    return Report(out, out / "index.html", made.view_command, _summary(ranking, made))


def _content(table: Table, ranking: Ranking, gallery: int) -> Content:
    planners = [s.planner for s in ranking.standings]
    pictures = draw_all(table, planners)
    shown, failed = failures(table, planners, gallery)
    trials = sum(r.completed for r in table.rows)
    linked = any(address_of(table, row) for row in table.rows)
    counts = f"{trials} trials, {len(table.problems)} problems, {len(planners)} planners"
    conditions = f", with {table.conditions}" if table.conditions else ""
    return Content(
        title=f"{table.root.resolve().name}: {counts}{conditions}",
        verdict=ranking.verdict,
        ranking=content.ranking_table(ranking.standings, ranking.table, ranking.comparable),
        references=content.references_table(ranking.standings, ranking.table),
        paper_figures=pictures[:_PAPER_FIGURES],
        figures=pictures[_PAPER_FIGURES:],
        tables=[
            content.comparison_table(table, planners),
            content.measures_table(table, planners),
            content.paper_table(planners, table),
            *content.causes_tables(table, planners),
            content.promises_table(table, planners),
            content.times_table(table, planners),
            content.difficulty_table(table),
            beaten_table(table),
            bounds_table(table),
            content.errors_table(table),
        ],
        details=[content.problems_table(table, planners), content.trials_table(table)],
        failures=shown,
        failed=failed,
        board=trial_board(table, planners),
        view_command=table.view_command if linked else "",
        method=[_OBJECTIVE, _INTERVALS, f"Diamonds: {CITATION}.", *_provenance(table)],
    )


def _provenance(table: Table) -> list[str]:
    """Sentences on where the trials come from."""
    store, told = Store(table.root), []
    for call in store.calls() if store.is_there else []:
        commit, machine = call.get("commit"), call.get("machine", {})
        source = (
            f"commit {commit['id'][:12]}{', changed' if commit['changed'] else ''}"
            if commit
            else "no checkout"
        )
        told.append(
            f"{call.get('started', '?')}: {' '.join(call.get('command', []))}; torc "
            f"{call.get('versions', {}).get('torc', '?')} ({source}); {machine.get('processor', '?')}, "
            f"{machine.get('cores', '?')} cores, {call.get('workers', '?')} workers; played {call.get('played', '?')}."
        )
    told += [f"Left out: {directory}: {why}." for directory, why in table.left_out[:20]]
    if len(table.left_out) > 20:
        told.append(f"... and {len(table.left_out) - 20} more.")
    return told


def _summary(ranking: Ranking, made: Content) -> dict[str, Any]:
    planners = []
    for s in ranking.standings:
        done = ranking.table.completed(s.planner)
        measures = {m.name: _plain(m.of(done)) for m in MEASURES}
        counts = {"planned": s.planned, "played": s.played, "completed": s.completed}
        facts = {"planner": s.planner, "reference": s.reference, "tie_with_the_best": s.ties}
        planners.append({**facts, **counts, "measures": measures})
    return {
        "format": REPORT_FORMAT,
        "answer": made.verdict.answer,
        "planner": made.verdict.planner,
        "warnings": list(made.verdict.warnings),
        "ranking": planners,
        "oracle_bound": bound_summary(ranking.table),
    }


def _plain(found: intervals.Estimate) -> dict[str, float | int | None]:
    """JSON has no NaN and no infinity."""
    facts = asdict(found)
    return {k: (None if isinstance(v, float) and not abs(v) < float("inf") else v) for k, v in facts.items()}
