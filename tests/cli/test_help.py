"""What --help says, at the width of a terminal."""

import inspect
import os
import subprocess
import sys

import pytest
from torc_command import run_torc

from torc.cli.commands import Group, filled
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


def test_the_first_page_has_a_line_per_command(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    _, out, _ = run_torc("--help", capsys=capsys)
    assert len(out.splitlines()) < 24
    lines = [line.split()[0] for line in out.splitlines() if line.startswith("  ")]
    assert lines == [*TORC.commands]


def test_help_of_an_option_is_one_paragraph(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "400")
    _, out, _ = run_torc("run", "--help", capsys=capsys)
    (line,) = [line for line in out.splitlines() if "Task planner:" in line]
    assert "vlm-grasps, vlm-fixes-dg (these three ask the model --vlm)" in line
    assert "(default: dg-select)" in line
    assert "default: None" not in out
    assert "default: False" not in out


def test_paragraphs_are_filled_and_indented_lines_kept(monkeypatch):
    monkeypatch.setenv("COLUMNS", "30")
    text = inspect.cleandoc(
        """Some words that are a good deal longer than a line.

        Try:
          torc a       # first
          torc b
        or nothing at all, which is longer."""
    )
    assert filled(text).rstrip().splitlines() == [
        "Some words that are a good",
        "deal longer than a line.",
        "",
        "Try:",
        "  torc a       # first",
        "  torc b",
        "or nothing at all, which is",
        "longer.",
    ]


@pytest.mark.parametrize("words", [["--help"], ["objects", "list"], ["run", "--help"]], ids=" ".join)
def test_a_reader_that_went_away_is_no_fault(words):
    reader, writer = os.pipe()
    os.close(reader)
    torc = [sys.executable, "-m", "torc.cli.main", *words]
    buffered = {k: v for k, v in os.environ.items() if k != "PYTHONUNBUFFERED"}
    ended = subprocess.run(torc, stdout=writer, stderr=subprocess.PIPE, env=buffered, check=False)
    os.close(writer)
    assert (ended.returncode, ended.stderr) == (141, b"")
