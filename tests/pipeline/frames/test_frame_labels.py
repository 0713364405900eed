"""Labels from anywhere become object ids."""

from pathlib import Path

import numpy as np
import pytest
from frame_makers import directory, npz, observe

from torc.errors import InputError
from torc.pipeline.frames import load_frame
from torc.records import BACKGROUND


def test_labels_from_anywhere_become_ids(tmp_path: Path) -> None:
    o = observe()
    numbers = {BACKGROUND: 0, 0: 40_000, 1: 7, 2: 512}
    labels = np.vectorize(numbers.__getitem__)(o.label_image).astype(np.uint16)
    frame = load_frame(npz(tmp_path, labels=labels, target=512))
    assert dict(frame.labels) == {7: 7, 1: 40_000, 0: 512}
    for object_id, label in frame.labels.items():
        np.testing.assert_array_equal(frame.observation.label_image == object_id, labels == label)
    assert frame.target_id == 0


def test_target_is_hidden_when_said_so(tmp_path: Path) -> None:
    frame = load_frame(npz(tmp_path, target="hidden"))
    assert frame.target_id is None
    assert 0 not in frame.labels
    assert frame.labels[3] == 0  # label 0 is an object here, but not the target


def test_a_forgotten_target_is_not_taken_for_a_hidden_one(tmp_path: Path) -> None:
    labels = observe().label_image + 1  # 0 is the background now
    with pytest.raises(InputError, match=r"one of \[1, 2, 3\], or 'hidden'"):
        load_frame(npz(tmp_path, labels=labels))


def test_target_by_name(tmp_path: Path) -> None:
    assert load_frame(directory(tmp_path, target="box")).labels[0] == 2


def test_names_that_are_no_target_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="'bxo' is neither"):
        load_frame(directory(tmp_path, target="bxo"))
