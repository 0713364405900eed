"""Write the report on directories of trials, and log it to an experiment tracker."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from torc.benchmark.intervals import Estimate
from torc.benchmark.measures import MEASURES, scores
from torc.benchmark.paper import CITATION
from torc.benchmark.reading import read_tables
from torc.benchmark.report import tables
from torc.benchmark.report.cells import KEY, Link, address_of, failures, openings, trial_board, words
from torc.benchmark.report.figures import Picture, draw_all
from torc.benchmark.report.pages import Section, html_page, markdown_page
from torc.benchmark.report.ranking import Ranking, bound_summary, rank_on_common_ground
from torc.benchmark.report.tables import beaten_table
from torc.benchmark.rows import Table, write_tables
from torc.benchmark.store import calls
from torc.errors import InputError, PartError, extra_remedy
from torc.registry.loading import blamed, registered
from torc.trials.viewer_links import REPORT

REPORT_FORMAT = "torc-report/1"
SECTIONS = "torc.report_sections"
"""Group of the entry points by which packages add sections: each names a function from a `Table` to `Section`s."""
_FIGURES = "figures"
_TO_COMMANDS = " Each leads to the command that shows the trial."
_TO_PICKS = " Where you open this report from the page of this command, each leads to the picks: "
_MOST_LEFT_OUT = 20


@dataclass(frozen=True)
class Report:
    """The report on disk; `advice` is a line for the user on how to see its trials, "" if they cannot be seen."""

    directory: Path
    page: Path
    advice: str
    summary: dict[str, Any]


def write_report(roots: Sequence[Path], out: Path, gallery: int = 24) -> Report:
    """Write index.html, report.md, figures and tables of the trials of some directories (see `read_tables`) to `out`.

    `gallery` is the most failed trials shown in pictures. Raises InputError: there are no trials, or the directory
    cannot be written; MissingDependencyError: matplotlib is not installed.
    """
    table = read_tables(roots)
    ranking = rank_on_common_ground(table)
    planners = [s.planner for s in ranking.standings]
    pictures = draw_all(table, planners)
    view = table.view_command if any(address_of(table, row) for row in table.rows) else ""
    served = bool(view) and out.resolve() == (table.root / REPORT.parent).resolve()
    links: list[str | Link] = [_TO_COMMANDS] if view else []
    advice = ""
    if served:
        links += [_TO_PICKS, Link(view, kind="code")]
        advice = f"To follow its links pick by pick, open Report in the page of: {view} --open"
    elif view:
        advice = f"Its trials, pick by pick: {view} --open"
    trials = f"{sum(r.completed for r in table.rows)} trials, {len(table.problems)} problems, {len(planners)} planners"
    conditions = f", with {table.conditions}" if table.conditions else ""
    title = f"{table.root.resolve().name or 'Report'}: {trials}{conditions}"
    sections = _sections(table, ranking, planners, pictures, gallery, links)
    html = html_page(title, ranking.verdict, sections, openings(table))
    markdown = markdown_page(title, ranking.verdict, sections, _FIGURES)
    try:
        (out / _FIGURES).mkdir(parents=True, exist_ok=True)
        for picture in pictures:
            (out / _FIGURES / f"{picture.name}.svg").write_bytes(picture.svg)
            (out / _FIGURES / f"{picture.name}.png").write_bytes(picture.png)
        write_tables(table, out)
        (out / "index.html").write_text(html, encoding="utf-8")
        (out / "report.md").write_text(markdown, encoding="utf-8")
    except OSError as error:
        raise InputError(f"Cannot write to '{out}': {error.strerror}. Choose another --out.") from error
    return Report(out, out / "index.html", advice, _summary(ranking))


def _sections(
    table: Table,
    ranking: Ranking,
    planners: Sequence[str],
    pictures: Sequence[Picture],
    gallery: int,
    links: Sequence[str | Link],
) -> list[Section]:
    """Return the sections of the pages; `links` say where the squares of the trials lead."""
    standings, ranked = ranking.standings, ranking.table
    competing = tables.ranking_table(standings, ranked, ranking.comparable)
    references = tables.references_table(standings, ranked)
    open_tables = [
        tables.sets_table(table, planners, ranking.verdict.planner),
        tables.within_table(table, planners),
        tables.scores_table(table, planners),
        tables.give_ups_table(table, planners),
        tables.comparison_table(table, planners),
        tables.measures_table(table, planners),
        *tables.causes_tables(table, planners),
        tables.promises_table(table, planners),
        tables.vlm_table(table, planners),
        beaten_table(table),
        tables.errors_table(table),
    ]
    shown, failed = failures(table, planners, gallery)
    caption = f"{len(shown)} of {failed} failed trials, one of each cause in turn. Click a picture to see that pick."
    how = "How this was made"
    with_rows = [t for t in open_tables if t.rows]
    return [
        *([Section("", [competing])] if competing.rows else []),
        *([Section(references.title, [references])] if references.rows else []),
        *_registered_sections(table),
        Section("The paper's figures, from these trials", pictures, "figures"),
        *(Section(t.title, [t], "" if i else "tables") for i, t in enumerate(with_rows)),
        Section("Every trial", [(*KEY, *links), trial_board(table, planners)], "trials"),
        Section("Failures", [caption if failed else "No completed trial failed.", *shown], "failures"),
        Section(how, [*words()[how], f"Diamonds: {CITATION}.", *_origins(table)], "method"),
    ]


def _registered_sections(table: Table) -> list[Section]:
    """Return the sections of installed packages, which register functions from the table to a list of them."""
    sections, makers = [], registered(SECTIONS)
    for name, load in makers.items():
        with blamed(f"The report's section '{name}'", PartError, "Repair the package, or uninstall it."):
            sections += load()(table)
    if "robot" not in makers and any(row.completed for row in table.on_robot.rows):
        remedy = f"These trials have tables of their own with torc-lab: {extra_remedy('lab')}."
        sections.append(Section("Trials on a real robot", [remedy], "robot"))
    return sections


def _origins(table: Table) -> list[str]:
    """Return sentences on where the trials come from."""
    told = []
    for call in calls(table.root):
        commit, machine = call.get("commit"), call.get("machine", {})
        changed = ", changed" if commit and commit["changed"] else ""
        source = f"commit {commit['id'][:12]}{changed}" if commit else "no checkout"
        told.append(
            f"{call.get('started', '?')}: {' '.join(call.get('command', []))}; torc "
            f"{call.get('versions', {}).get('torc', '?')} ({source}); {machine.get('processor', '?')}, "
            f"{machine.get('cores', '?')} cores, {call.get('workers', '?')} workers; played {call.get('played', '?')}."
        )
    told += [f"Left out: {directory}: {why}." for directory, why in table.left_out[:_MOST_LEFT_OUT]]
    if len(table.left_out) > _MOST_LEFT_OUT:
        told.append(f"... and {len(table.left_out) - _MOST_LEFT_OUT} more.")
    return told


def _summary(ranking: Ranking) -> dict[str, Any]:
    table = ranking.table
    planners = [
        {
            "planner": s.planner,
            "reference": s.reference,
            "tie_with_the_best": s.ties,
            "planned": s.planned,
            "played": s.played,
            "completed": s.completed,
            "measures": {m.name: _plain(m.of(table.completed(s.planner))) for m in MEASURES},
            "scores": {name: _plain(found) for name, found in scores(table, s.planner).items()},
        }
        for s in ranking.standings
    ]
    return {
        "format": REPORT_FORMAT,
        "answer": ranking.verdict.answer,
        "planner": ranking.verdict.planner,
        "warnings": list(ranking.verdict.warnings),
        "ranking": planners,
        "oracle_bound": bound_summary(table),
    }


def _plain(found: Estimate) -> dict[str, float | int | None]:
    """Replace NaN and infinity, which JSON lacks, by None."""
    return {k: v if abs(v) < float("inf") else None for k, v in asdict(found).items()}


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
