"""What --help says, at the width of a terminal."""

import os
import subprocess
import sys

import pytest
from torc_command import run_torc

from torc.cli.commands import Group
from torc.cli.main import TORC


def leaves(group=TORC, path=()):
    """Every command that is none but a group, by its words."""
    for name, (_, command) in group.commands.items():
        if isinstance(command, Group):
            yield from leaves(command, (*path, name))
        else:
            yield (*path, name)


@pytest.mark.parametrize("words", [(), ("problems",), ("objects",), *leaves()], ids=" ".join)
def test_help_fits_eighty_columns(words, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = run_torc(*words, "--help", capsys=capsys)
    assert code == 0
    assert f"usage: torc {' '.join(words)}".strip() in out
    assert [line for line in out.splitlines() if len(line) > 80 and not line.startswith("usage:")] == []


@pytest.mark.parametrize("words", [["--help"], ["objects", "list"], ["run", "--help"]], ids=" ".join)
def test_a_reader_that_went_away_is_no_fault(words):
    reader, writer = os.pipe()
    os.close(reader)
    torc = [sys.executable, "-m", "torc.cli.main", *words]
    buffered = {k: v for k, v in os.environ.items() if k != "PYTHONUNBUFFERED"}
    ended = subprocess.run(torc, stdout=writer, stderr=subprocess.PIPE, env=buffered, check=False)
    os.close(writer)
    assert (ended.returncode, ended.stderr) == (141, b"")
