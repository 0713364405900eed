"""Trials that share only the root of the disk have no viewer, so none is offered."""

from pathlib import Path

from torc.benchmark.rows import Table


def test_no_viewer_of_the_whole_disk_is_offered():
    assert Table(Path("/"), ()).view_command == ""
    assert Table(Path("/runs"), ()).view_command == "torc view /runs"
