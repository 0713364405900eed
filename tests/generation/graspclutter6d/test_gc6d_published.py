"""The paper's problems, labels and names."""

from collections import Counter

import pytest

from torc.errors import InputError
from torc.generation.graspclutter6d.published import (
    object_words,
    paper_problems,
    parse_object_name,
    published_category,
)


def test_the_paper_has_forty_problems_half_of_them_structured():
    problems = paper_problems()
    assert Counter(p.category for p in problems) == {"structured": 20, "unstructured": 20}
    assert len({(p.scene, p.target) for p in problems}) == 40
    assert all(published_category(p.scene) == p.category for p in problems)
    assert all("object" not in object_words(parse_object_name(p.target)[0]) for p in problems)


def test_every_scene_has_a_label_and_every_object_words():
    labels = Counter(published_category(scene) for scene in range(1000))
    assert labels == {"structured": 66 + 116, "unstructured": 626 + 192}
    assert published_category(1000) is None
    assert object_words(44) == "the can of peaches"
    assert object_words(42) == "object 42 of GraspClutter6D"


@pytest.mark.parametrize("text", ["44_1", "obj_000044_1", "000044_1"])
def test_objects_are_named_in_short_or_in_full(text):
    assert parse_object_name(text) == (44, 1)
    assert parse_object_name(text[:-2]) == (44, None)


@pytest.mark.parametrize("text", ["", "0", "44_", "../44", "44_1_2", "obj_44_1\n", "4" * 30, "٤٤", "-1"])
def test_anything_else_is_refused(text):
    with pytest.raises(InputError, match="is no object of a scene"):
        parse_object_name(text)
