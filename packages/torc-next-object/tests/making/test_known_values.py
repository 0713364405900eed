"""Values that travel with the project."""

import pytest

from torc.errors import InputError
from torc_next_object.making.known_values import KnownValues
from torc_next_object.making.pricing import Price

VALUES = {3: Price(2.5, 2.25, 2.75), 0: Price(1.0, 1.0, 15.0)}


def test_values_are_there_again_when_the_file_is_read(tmp_path):
    path = tmp_path / "there" / "values.jsonl"
    known = KnownValues(path)
    assert known.get("a") is None
    known.add("a", VALUES)
    known.add("b", {1: Price(1.00004, 1, 2)})
    again = KnownValues(path)
    assert again.get("a") == known.get("a") == VALUES
    assert again.get("b") == known.get("b") == {1: Price(1.0, 1, 2)}


def test_without_a_file_nothing_is_kept():
    known = KnownValues(None)
    known.add("a", VALUES)
    assert known.get("a") == VALUES
    assert KnownValues(None).get("a") is None


@pytest.mark.parametrize(
    "line",
    [
        "{",
        "[]",
        '{"id": "a"}',
        '{"id": "a", "values": {"x": [1, 2, 3]}}',
        '{"id": "a", "values": {"1": [1, 2]}}x',
    ],
)
def test_another_file_is_refused(tmp_path, line):
    path = tmp_path / "values.jsonl"
    path.write_text(line + "\n")
    with pytest.raises(InputError, match="line 1"):
        KnownValues(path)
