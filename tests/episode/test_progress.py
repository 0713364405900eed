"""What the terminal shows while a trial is played."""

import io
from typing import get_args

import pytest
from rich.console import Console

from torc.episode.events import Event, Executed, Started
from torc.episode.progress import _NEXT, TerminalProgress
from torc.records import PickOutcome, PickResult

STARTED = Started("test", "scripted", 3, "the [red] box", 5, ("red_box", "mug"))


@pytest.fixture
def terminal():
    return Console(file=io.StringIO(), force_terminal=True, width=100, color_system=None)


def _shown(terminal, *events):
    with terminal.status("preparing...") as status:
        progress = TerminalProgress(terminal, status)
        for event in events:
            progress(event)
        return terminal.file.getvalue(), status.status


def test_names_stand_beside_ids_and_brackets_are_text(terminal):
    outcome = PickOutcome(PickResult.REMOVED, 0, duration_s=4.0, dropped=(1,))
    text, _ = _shown(terminal, STARTED, Executed(0, outcome, 1.0))
    assert "the [red] box" in text
    assert "dropped 1 (mug)" in text


def test_every_event_can_be_shown(terminal):
    assert set(_NEXT) == set(get_args(Event))
