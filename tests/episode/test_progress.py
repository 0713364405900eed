"""What the terminal shows while a trial is played."""

import io
from typing import get_args

import numpy as np
import pytest
from rich.console import Console

from torc.drawing.strip import Frame, crop_around_objects, picture_strip
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


@pytest.mark.parametrize(
    "box", [(10, 20, 30, 40), (0, 480, 0, 640), (470, 480, 630, 640), (200, 203, 5, 600)]
)
def test_crop_holds_all_objects_in_the_images_own_aspect(box):
    labels = np.full((480, 640), -1, np.int16)
    labels[box[0] : box[1], box[2] : box[3]] = 3
    part = labels[crop_around_objects(labels)]
    assert np.count_nonzero(part == 3) == np.count_nonzero(labels == 3)
    assert part.shape[1] / part.shape[0] == pytest.approx(640 / 480, rel=0.03)


@pytest.mark.parametrize("picks", [1, 4, 5, 9])
def test_strip_holds_every_pick(picks, rng):
    image = rng.integers(0, 255, (48, 64, 3), dtype=np.uint8)
    done = PickOutcome(PickResult.REMOVED, 1)
    frames = [
        Frame(i, image, None if i == 2 else i, "because " * 40, done if i else None) for i in range(picks)
    ]
    strip = picture_strip(frames)
    assert strip.shape[1] == 480 * min(picks, 4)
    assert strip.shape[0] == (480 * 48 // 64 + 92) * -(-picks // 4)
