"""A reply becomes a number that was offered, or nothing; nothing is raised."""

import random

import pytest

from torc_next_object.replies import read_number

OFFERED = (0, 3, 7, 12)


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("7", 7),
        ("**7**", 7),
        ("Object 7.", 7),
        ("0", 0),
        ("3 is behind 12.\nAnswer: 7", 7),
        ("Answer: 3\nNo, wait. 12 hides it.\n**Final answer: object 7**", 7),
        ("The answer is 7.", 7),
        (r"So \boxed{7}", 7),
        ('```json\n{"thoughts": "3, 12", "plan": [{"action": "remove", "input": 7}]}\n```', 7),
        ('[{"action": "pick", "input": "object 7"}]', 7),
        ('{"answer": 7.0}', 7),
        ('{"thoughts": "3"} and then\nAnswer: 7', 7),
        ("<think>3? 12?</think>7", 7),
        ("I would remove object 7, because object 7 is in front.", 7),
        ("Answer: 7 or 3", None),
        ("3, 7", None),
        ("[3, 7]", None),
        ("-7", None),
        ("7.5", None),
        ("Answer: 77", None),
        ("Answer: -7", None),
        ("C", None),
        ("Answer: C", None),
        ("", None),
        ('{"answer": NaN}', None),
        ('{"answer": true}', None),
        ('{"answer": [7]}', 7),
        ('{"answer": ["object_7"]}', 7),
        ('"object_7"', 7),
        ("[7]", 7),
        ('["7"]', 7),
        ("```json\n[7]\n```", 7),
        ('{"object": "object_7", "thoughts": "3 and 12 stand behind it"}', 7),
        ('{"thoughts": "3 and 12 stand behind it", "answer": 7,}', 7),
        ('{"plan": [{"action": "remove", "input": "Object_7",}, {"action": "pick", "input": 0},]}', 7),
        ("3 is behind 12, which is long to tell. " * 9 + "\nAnswer: object_7", 7),
        ("Answer: [7]", 7),
        ("Answer: object 7 or object 3", None),
        ("Answer: object_7 and object_3", None),
        ("Answer: [7], [3]", None),
        ("Answer: [7, 3]", None),
        ('{"answer": [7, 3]}', None),
        ('{"answer": [-7]}', None),
        ('{"answer": -7}', None),
        ('"object_-7"', None),
        ('{"plan": []}', None),
        ('{"plan": [{"action": "push", "input": 7}]}', None),
        ('{"plan": [{"action": "remove", "input": 99}]}\nor 7', None),
        ("7" * 100_000, None),
        ("[" * 100_000, None),
        ("\u0667", None),
        (None, None),
        (7, None),
    ],
)
def test_a_reply_names_what_it_marks_as_the_answer(text, number):
    assert read_number(text, OFFERED) == number


def test_a_lone_number_in_a_long_text_may_be_anything():
    assert read_number("It is hard to tell. " * 20 + "There are 7 cans.", OFFERED) is None


def test_no_text_raises_or_names_what_was_not_offered():
    rng = random.Random(0)
    pieces = [
        "Answer:",
        "7",
        "-3",
        "12",
        '{"plan": [',
        '{"action": "remove", "input": ',
        "}",
        "]",
        "```",
        "\n",
    ]
    pieces += ["</think>", "NaN", "\\boxed{", "\x00", "\ud800", "1e999", " or ", "object"]
    for _ in range(3000):
        text = " ".join(rng.choices(pieces, k=rng.randrange(12)))
        assert read_number(text, OFFERED) in (None, *OFFERED)
