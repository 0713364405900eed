"""Files are written whole, or the reason is told."""

import json

import cv2
import numpy as np
import pytest

from torc.records.files import write_json, write_png


def test_json_replaces_a_file_and_leaves_nothing_else(tmp_path):
    path = tmp_path / "a.json"
    for value in (1, {"b": [2, "ü"]}):
        write_json(path, value)
        assert json.loads(path.read_text()) == value
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]
    with pytest.raises(TypeError):
        write_json(path, [1, object()])
    assert json.loads(path.read_text()) == {"b": [2, "ü"]}


def test_pictures_keep_their_colours(tmp_path, rng):
    rgb = rng.integers(0, 256, (7, 9, 3), dtype=np.uint8)
    write_png(tmp_path / "a.png", rgb)
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / "a.png"))[..., ::-1], rgb)
    with pytest.raises(OSError, match=r"a\.png"):
        write_png(tmp_path / "nowhere" / "a.png", rgb)
