"""The example frame gives a decision, and is what its script makes."""

from pathlib import Path

import numpy as np

import make_frame
from torc import decide_frame, load_frame, save_frame

FRAME = Path(__file__).with_name("frame.npz")


def test_what_stands_in_the_way_of_the_target_goes_first():
    answer = decide_frame(load_frame(FRAME))
    assert (answer.label, answer.left_out) == (6, ())
    assert "blocked grasps of the target" in answer.decision.reason


def test_it_is_what_the_script_makes(tmp_path):
    """Whatever draws here: some pixels at edges may differ."""
    make_frame.main(tmp_path / "frame.npz")
    new, shipped = load_frame(tmp_path / "frame.npz"), load_frame(FRAME)
    assert new.target_description == shipped.target_description
    assert np.array_equal(new.observation.K, shipped.observation.K)
    assert np.mean(new.label_image == shipped.label_image) > 0.98
    near = np.abs(new.observation.depth_m - shipped.observation.depth_m) < 0.002
    assert np.mean(near) > 0.98


def test_it_can_be_written_in_the_other_form(tmp_path):
    frame = load_frame(FRAME)
    save_frame(tmp_path / "frame", frame)
    again = load_frame(tmp_path / "frame")
    assert np.array_equal(again.label_image, frame.label_image)
    assert np.abs(again.observation.depth_m - frame.observation.depth_m).max() < 1e-4
