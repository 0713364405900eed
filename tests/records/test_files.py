"""Files are written whole, or the reason is told."""

import json

import pytest

from torc.records.files import write_json


def test_json_replaces_a_file_and_leaves_nothing_else(tmp_path):
    path = tmp_path / "a.json"
    for value in (1, {"b": [2, "ü"]}):
        write_json(path, value)
        assert json.loads(path.read_text()) == value
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]
    with pytest.raises(TypeError):
        write_json(path, [1, object()])
    assert json.loads(path.read_text()) == {"b": [2, "ü"]}
