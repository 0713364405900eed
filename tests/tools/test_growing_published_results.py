"""Published results grow by trials that were played elsewhere, and their pages show what they hold."""

from dataclasses import replace
from pathlib import Path

import pytest

from tools.published_results import Add, with_tables
from torc.benchmark.reading import read_table
from torc.benchmark.rows import Table, write_tables
from torc.benchmark.store import calls
from torc.errors import InputError
from torc.io.results import write_json

PUBLISHED = Path(__file__).parents[2] / "results" / "torc40"
KEPT = {"structured-01", "structured-02", "unstructured-01"}


def part(directory, seeds):
    """Some of the published trials, as if they alone had been played."""
    directory.mkdir()
    table = read_table(PUBLISHED)
    rows = [r for r in table.rows if r.seed in seeds and r.problem in KEPT]
    rows = [replace(r, directory=directory / r.directory.relative_to(PUBLISHED)) for r in rows]
    write_tables(Table(directory, tuple(rows)), directory)
    write_json(directory / "manifest.json", {"calls": [{"command": ["torc", "bench", directory.name]}]})
    return directory


def lines(directory):
    return [(directory / name).read_text().splitlines() for name in ("trials.csv", "picks.csv")]


@pytest.mark.long
def test_parts_that_are_put_together_are_the_whole(tmp_path):
    whole, some, more = (
        part(tmp_path / name, seeds) for name, seeds in (("a", {0, 1, 2}), ("b", {0}), ("c", {1, 2}))
    )
    Add(more, some)()
    assert lines(some) == lines(whole)
    assert [call["command"][-1] for call in calls(some)] == ["b", "c"]
    assert "27 trials" in (some / "report.md").read_text()
    assert not (some / "index.html").exists()


def test_the_first_part_begins_new_results(tmp_path):
    some = part(tmp_path / "a", {0})
    new = tmp_path / "new"
    Add(some, new)()
    assert lines(new) == lines(some)


def test_trials_that_are_there_already_are_refused(tmp_path):
    some, same = part(tmp_path / "a", {0, 1}), part(tmp_path / "b", {1})
    before = lines(some)
    with pytest.raises(InputError, match="same planner, problem and seed"):
        Add(same, some)()
    assert lines(some) == before


@pytest.mark.long
def test_a_page_gets_the_rows_of_its_columns_and_pairs():
    table = read_table(PUBLISHED)
    page = "Text.\n\n| planner | scenes | trials | drops |\n|---|---|---|---|\n| old | all | 1 | 9 |\n\n"
    page += "| pair | trials of both |\n|---|---|\n| dg-select - random | 1 |\n\n"
    page += "| its own | table |\n|---|---|\n| 1 | 2 |\n"
    found = with_tables(page, table)
    assert "| random | unstructured | 200 | " in found
    assert "| old |" not in found
    assert found.count("| dg-select - ") == 1
    assert "| dg-select - random | 400 |" in found
    assert found.startswith("Text.\n\n| planner | scenes | trials | drops |\n|---|---|---|---|\n| ")
    assert found.endswith("\n\n| its own | table |\n|---|---|\n| 1 | 2 |\n")
    assert with_tables(found, table) == found


@pytest.mark.long
@pytest.mark.parametrize("name", ["torc-hard", "torc40"])
def test_the_pages_are_as_they_are_made(name):
    table = read_table(PUBLISHED.parent / name)
    page = (PUBLISHED.parent / name / "README.md").read_text()
    assert with_tables(page, table) == page
