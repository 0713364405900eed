"""The report says what the trials say, works offline, and lets no text out of its place."""

import csv
import html
import re
import shutil
from collections import Counter
from pathlib import Path

import pytest

from torc.benchmark.reading import read_table
from torc.benchmark.report import figures, tables, writing
from torc.benchmark.report.cells import words
from torc.benchmark.report.writing import write_report
from torc.benchmark.rows import Table
from torc.trials.viewer_links import trial_link
from torc.web.shelf import Shelf

pytest.importorskip("matplotlib", reason="the extra 'report' is not installed")


@pytest.fixture(scope="module")
def report(played, tmp_path_factory):
    """Written once."""
    return write_report([played], tmp_path_factory.mktemp("report"), gallery=5)


@pytest.fixture(scope="module")
def page(report):
    """The text of the page."""
    return report.page.read_text()


def test_the_first_words_answer_the_question(report, page):
    body = page.split("<body>")[1]
    assert body.index("Which planner should I use?") < body.index("<table")
    assert html.escape(report.summary["answer"]) in body[: body.index("<table")]
    assert any("errored" in w for w in report.summary["warnings"])
    assert any("2 planned trials" in w for w in report.summary["warnings"])


def test_every_planner_stands_in_the_ranking_references_last_and_apart(report, page):
    names = [p["planner"] for p in report.summary["ranking"]]
    assert set(names) == {"random", "dg-select", "human anna (outside view)", "mine:<b>&amp;|`*_"}
    ranking, references = page.split("<h2>References, not ranked</h2>")
    assert "human anna" not in ranking
    assert "human anna" in references.split("</table>")[0]
    text = (report.directory / "report.md").read_text()
    assert text.index("## References, not ranked") < text.index("human anna")
    by_name = {p["planner"]: p for p in report.summary["ranking"]}
    assert by_name["random"]["measures"]["retrieved"]["count"] == by_name["random"]["completed"]


def test_every_trial_is_a_link_into_the_viewer(played, page, report):
    table = read_table(played)
    keys = set(Shelf(played).directories())
    # The errored one left no log, so that there is nothing to look at.
    assert len(keys) == sum(r.completed for r in table.rows) == 34
    board = page.split('id="trials"')[1].split("<table>")[1].split("</table>")[0]
    squares = re.findall(r'<(a|span) class="square (\w+)" title="[^"]*"(?: href="([^"]*)")?>', board)
    assert Counter(kind for _, kind, _ in squares)["missing"] == 2
    assert len(squares) == len(table.rows) == 37
    assert set(re.findall(r'href="#(\w+)/0"', board)) == keys


def test_a_link_of_the_file_leads_to_the_command_that_shows_the_trial(played, page, report):
    """Nothing but the file is needed: no viewer, at whatever port."""
    linked = set(re.findall(r'href="#(\w{12}/\d+)"', page))
    openings = dict(re.findall(r'<p class="opening" id="(\w+/\d+)">.*?<code>(.*?)</code>', page))
    assert linked <= set(openings)
    by_key = {
        key: html.escape(f"torc view '{path}' --open") for key, path in Shelf(played).directories().items()
    }
    assert {where: by_key[where.split("/")[0]] for where in openings} == openings
    for text in (page, (report.directory / "report.md").read_text()):
        assert "127.0.0.1" not in text


def test_only_a_report_that_the_viewer_serves_speaks_of_its_page(played, page, tmp_path):
    """Written elsewhere, no viewer has it."""
    copied = shutil.copytree(played, tmp_path / "trials")
    served = write_report([copied], copied / "report", gallery=0)
    from_its_page = "Where you open this report from the page of"
    assert f"{from_its_page} this command, each leads to the picks: <span><code>torc view {copied}<" in (
        served.page.read_text()
    )
    assert "open Report" in served.advice
    assert from_its_page not in page


def test_a_failure_links_to_the_pick_that_failed(played, page):
    table = read_table(played)
    failed = {
        trial_link(played, r.directory, r.failed_pick.pick)
        for r in table.rows
        if r.completed and not r.retrieved
    }
    found = set(re.findall(r'<a href="([^"]*)"><img', page))
    assert len(found) == min(5, len(failed)) > 0
    assert found <= failed


def test_the_page_needs_nothing_from_outside(page):
    assert "<script" not in page
    assert not re.findall(r'src="(?!data:)', page)
    assert not re.findall(r'href="(?!#)', page)
    assert "default-src 'none'" in page


def test_every_note_of_words_stands_under_a_table_or_figure_that_there_is():
    code = "".join(Path(module.__file__).read_text() for module in (figures, tables, writing))
    for title, paragraphs in words().items():
        assert f'"{title.removeprefix("Figure: ")}"' in code
        assert all(paragraphs)


def test_strange_names_stay_text(page, report):
    assert "<b>&amp;|" not in page
    assert "&lt;b&gt;&amp;amp;|`*_" in page
    text = (report.directory / "report.md").read_text()
    assert "mine:\\<b\\>&amp;\\|\\`\\*\\_" in text


def test_tables_for_other_programs(report, played):
    with open(report.directory / "trials.csv", newline="", encoding="utf-8") as f:
        rows = list(csv.DictReader(f))
    assert len(rows) == len(read_table(played).rows) == 37
    assert {r["status"] for r in rows} == {"completed", "errored", "missing"}
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(report.directory / "trials.parquet")
    assert table.column("picks").to_pylist() == [int(r["picks"]) for r in rows]
    assert table.column("retrieved").to_pylist() == [r["retrieved"] == "True" for r in rows]


def test_no_viewer_of_the_whole_disk_is_offered():
    """Trials that share only the root of the disk have no viewer."""
    assert Table(Path("/"), ()).view_command == ""
    assert Table(Path("/runs"), ()).view_command == "torc view /runs"
