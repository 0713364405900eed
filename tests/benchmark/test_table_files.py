"""What a report leaves as tables tells another report the same."""

from dataclasses import replace

import pytest

from torc.benchmark.ranking import rank
from torc.benchmark.reading import read_table, read_tables
from torc.benchmark.report.writing import write_report
from torc.benchmark.table_files import PICKS_FILE, TRIALS_FILE, write_tables
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


def test_a_report_of_tables_alone_speaks_of_no_links(kept, tmp_path):
    pytest.importorskip("matplotlib", reason="the extra 'report' is not installed")
    report = write_report([kept], tmp_path / "report")
    assert not report.view_command
    assert "torc view" not in report.page.read_text() + (report.directory / "report.md").read_text()


def test_several_directories_are_one_table(played, kept):
    both = read_tables([played, kept])
    assert len(both.rows) == len(both.left_out) == len(read_table(played).rows)
    assert all(r.directory.is_relative_to(both.root) for r in both.rows)
    text = (kept / TRIALS_FILE).read_text()
    (kept / TRIALS_FILE).write_text(text.replace("dg-select", "other"))
    assert set(read_tables([played, kept]).planners) == {*read_table(played).planners, "other"}


@pytest.mark.parametrize("name", [TRIALS_FILE, PICKS_FILE])
@pytest.mark.parametrize("garbage", ["a,b\n1,2\n", "planner,problem,seed,picks\nx,y,many,\n", "\0\n\0"])
def test_other_tables_are_refused(kept, name, garbage):
    (kept / name).write_text(garbage)
    with pytest.raises(InputError, match=name):
        read_table(kept)
