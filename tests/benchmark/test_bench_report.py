"""The report says what the trials say, works offline, and lets no text out of its place."""

import csv
import html
import re
import shutil
from collections import Counter

import pytest

from torc.benchmark.reading import read_table
from torc.benchmark.report.tables import trials_table
from torc.benchmark.report.writing import write_report
from torc.benchmark.store import Store
from torc.episode.viewer_links import VIEWER, trial_link
from torc.errors import InputError
from torc.web.shelf import Shelf

pytest.importorskip("matplotlib", reason="the extra 'report' is not installed")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FIGURES = ("success", "picks", "drops", "decision_time", "categories", "problems")


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
    assert len(trials_table(table).rows) == 35
    # The errored one left no log, so that there is nothing to look at.
    assert len(keys) == sum(r.completed for r in table.rows) == 34
    board = page.split('id="trials"')[1].split("<table>")[1].split("</table>")[0]
    squares = re.findall(r'<(a|span) class="square (\w+)" title="[^"]*"(?: href="([^"]*)")?>', board)
    assert Counter(kind for _, kind, _ in squares)["missing"] == 2
    assert len(squares) == len(table.rows) == 37
    markdown = (report.directory / "report.md").read_text()
    text = board, page.split('id="details"')[1], markdown.split("## Every trial")[1]
    for part in text:
        assert set(re.findall(rf"{VIEWER}#(\w+)/0", part)) == keys
    for part in (page, markdown):
        assert html.escape(f"torc view '{played}'", quote=part is page) in part


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
    assert not re.findall(rf'href="(?!#|{VIEWER}#)', page)
    assert "default-src 'none'" in page


def test_strange_names_stay_text(page, report):
    assert "<b>&amp;|" not in page
    assert "&lt;b&gt;&amp;amp;|`*_" in page
    text = (report.directory / "report.md").read_text()
    assert "mine:\\<b\\>&amp;\\|\\`\\*\\_" in text


def test_the_gallery_shows_failed_picks(page, played):
    table = read_table(played)
    failed = sum(r.completed and not r.retrieved for r in table.rows)
    assert f"{min(failed, 5)} of {failed} failed trials" in page
    assert page.count("data:image/jpeg") == min(failed, 5)
    assert "nothing between the fingers" in page


def test_tables_for_other_programs(report, played):
    with open(report.directory / "trials.csv", newline="", encoding="utf-8") as f:
        rows = list(csv.DictReader(f))
    assert len(rows) == len(read_table(played).rows) == 37
    assert {r["status"] for r in rows} == {"completed", "errored", "missing"}
    duckdb = pytest.importorskip("duckdb")
    query = f"select count(*), sum(picks) from '{report.directory}/trials.parquet'"
    with duckdb.connect() as connection:
        assert connection.execute(query).fetchall() == [(37, sum(int(r["picks"]) for r in rows))]


def test_a_single_trial_has_a_report_too_and_no_benchmark_takes_its_place(tmp_path, played):
    one = tmp_path / "one"
    shutil.copytree(next(played.glob("trials/*-random-0-*")), one)
    report = write_report([one], tmp_path / "report")
    assert [p["completed"] for p in report.summary["ranking"]] == [1]
    with pytest.raises(InputError, match="is a trial, not a benchmark"):
        Store(one).check_writable()


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium here; on Debian: apt-get install chromium")
def test_in_a_browser_without_network_the_first_screen_answers(report):
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run"]
    with playwright.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=CHROMIUM, args=flags)
        page = browser.new_context(viewport={"width": 1280, "height": 720}, offline=True).new_page()
        complaints = []
        page.on("console", lambda message: complaints.append(message.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(report.page.as_uri())
        for part in (".answer .it", "table >> nth=0"):
            box = page.locator(part).bounding_box()
            assert box["y"] + box["height"] <= 720
        page.evaluate("Promise.all(Array.from(document.images).map(i => i.decode()))")
        sizes = page.evaluate("Array.from(document.images).map(i => i.naturalWidth)")
        failed = sum(r.completed and not r.retrieved for r in read_table(report.page.parent).rows)
        assert len(sizes) == len(FIGURES) + min(5, failed)
        assert min(sizes) > 0
        assert page.evaluate("document.documentElement.scrollWidth") <= 1280
        browser.close()
    assert complaints == []
