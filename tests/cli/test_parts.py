"""Parts on the command line: lists of them in the help, and their settings."""

import pytest

from torc.cli.main import parse
from torc.errors import UnknownNameError


def _help(capsys, *arguments):
    with pytest.raises(SystemExit):
        parse([*arguments, "--help"])
    return capsys.readouterr().out


def test_help_lists_what_an_option_can_name(capsys):
    text = _help(capsys, "run")
    assert "--planner: one of these, or your own as module:Class" in text
    assert "  dg-select     The paper's planner" in text
    assert "--planners: one of these" in _help(capsys, "bench")
    assert "  look-alikes " in _help(capsys, "problems", "generate")


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("occlusion", "--occlusion.smooth-px"),
        ("dg-select", "--planner.relations.closeness-m"),
        ("perception", "--perception.min-pixels"),
        ("tests.cli.test_parts:Camera", "--camera.step"),
    ],
)
def test_settings_of_stages_and_parts_are_listed(capsys, name, line):
    assert parse(["settings", name]).run() == 0
    assert any(shown.startswith(line) for shown in capsys.readouterr().out.splitlines())


def test_parts_of_the_same_name_are_told_apart(capsys):
    parse(["settings", "simulated"]).run()
    shown = capsys.readouterr().out.splitlines()
    assert {"Camera simulated has no settings.", "VLM client simulated:"} <= {*shown}


def test_an_unknown_part_is_refused():
    with pytest.raises(UnknownNameError, match="Did you mean 'dg-select'"):
        parse(["settings", "dg-selct"]).run()


class Camera:
    def __init__(self, camera, step=2):
        self.step = step

    def capture(self): ...
