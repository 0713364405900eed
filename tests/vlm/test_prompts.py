"""Prompts as files: round trips, clear refusals, and what is asked where a schema holds the reply."""

from pathlib import Path

import numpy as np
import pytest

from tests.helpers.fake_vlm import ScriptedVlm
from torc.errors import InputError
from torc.pipeline.planners import make_planner, planner_context
from torc.testing import contexts
from torc.vlm.asker import fill_prompt
from torc.vlm.config import Asking, VlmConfig
from torc.vlm.picture_config import PictureConfig
from torc.vlm.prompt import Example, Prompt
from torc.vlm.prompt_files import (
    FORMAT,
    load_prompt,
    parse_prompt,
    prompt_text,
    shipped_names,
    shipped_prompt,
)

OWN = Prompt(
    "mine",
    "Target $target, called $description: which of $objects?\n\n  $history",
    "You are a robot: that costs $$5 a day.",
    "Think, then answer.",
    "Answer.",
    (Example("Which?", '{"plan": []}\n# "done": yes'), Example("And: now?", "- none")),
)


def asked(name, prompt=None, structured=True, context=None, picture=None):
    vlm = ScriptedVlm(["?"])
    asking = Asking(picture or PictureConfig(), prompt, structured)
    planner = make_planner(name, client=vlm, asking=asking)
    decision = planner.decide(context or contexts.behind_context(), np.random.default_rng(0))
    return vlm.questions[0], decision


@pytest.mark.parametrize("prompt", [OWN, *map(shipped_prompt, shipped_names())], ids=lambda p: p.name)
def test_prompts_survive_a_file(prompt, tmp_path):
    path = tmp_path / f"{prompt.name}.yaml"
    path.write_text(prompt_text(prompt), encoding="utf-8")
    assert load_prompt(path) == prompt
    assert load_prompt(path).digest == prompt.digest


def test_the_digest_follows_the_content_alone():
    text = prompt_text(OWN)
    assert parse_prompt(text, "other", "other").digest == OWN.digest
    assert parse_prompt(text.replace("Which?", "What?"), "mine", "mine").digest != OWN.digest


@pytest.mark.parametrize("name", ["vlm-select", "vlm-grasps", "vlm-fixes-dg"])
def test_free_thinking_is_asked_for_only_where_no_schema_forbids_it(name):
    free, strict = (asked(name, structured=s)[0].prompt for s in (False, True))
    assert "First think" in free
    assert "fenced" in free
    assert "First think" not in strict
    assert "fenced" not in strict
    assert '"thoughts" first' in strict
    assert next(iter(asked(name)[0].schema["properties"])) == "thoughts"


def test_the_new_prompts_ask_in_free_text_word_for_word_as_the_old_ones():
    values = {"target": 0, "target_state": "It is in sight.", "facts": "F", "relations": "R"}
    for name in ("vlm-select", "vlm-grasps", "vlm-fixes-dg"):
        assert fill_prompt(f"{name}-2", **values) == fill_prompt(f"{name}-1", **values)


def test_a_prompt_of_ones_own_is_what_is_sent_and_the_log_tells_it():
    question, decision = asked("vlm-select", OWN)
    assert question.system == "You are a robot: that costs $5 a day."
    assert question.examples == OWN.examples
    assert question.prompt.startswith("Target 0, called ")
    assert question.prompt.endswith("None so far.\n\nAnswer.")
    facts = decision.evidence.vlm
    assert (facts.prompt, facts.prompt_sha256) == ("mine", OWN.digest)
    assert facts.system == question.system
    assert len(facts.examples) == 2
    assert [p["sha256"] for p in facts.pictures] == [facts.image_sha256]


def test_pictures_are_sent_as_they_are_asked_for_and_kept():
    question, decision = asked("vlm-grasps", picture=PictureConfig("outlines", True, 5, 800))
    assert question.images == decision.pictures
    shown = decision.evidence.vlm.pictures
    assert [p["shows"] for p in shown] == ["marked", "plain"]
    assert {max(p["width"], p["height"]) for p in shown} == {800}
    assert "outlined" in question.prompt
    assert "tinted" not in question.prompt


@pytest.mark.parametrize(
    ("planner", "user", "told"),
    [
        ("vlm-select", "Pick $target. $facts", "fills no $facts"),
        ("vlm-select", "Pick something.", "has no $target"),
        ("vlm-grasps", "Pick $target.", "has no $facts"),
        ("vlm-fixes-dg", "Pick $target.", "has no $relations"),
        ("vlm-select", "Pick $target in $colour.", "fills no $colour"),
    ],
)
def test_a_prompt_that_does_not_fit_is_refused_before_anything_is_asked(planner, user, told):
    with pytest.raises(InputError) as refused:
        make_planner(planner, client=ScriptedVlm(["?"]), asking=Asking(prompt=Prompt("p", user)))
    assert told in str(refused.value)


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("a.yaml", "user: hi", "format"),
        ("a.yaml", f"format: {FORMAT}", "user"),
        ("a.yaml", f"format: {FORMAT}\nuser: hi\nuser_text: no", "user_text"),
        ("a.yaml", f"format: {FORMAT}\nuser: that costs $ 5", "has a \\$ that begins no field"),
        ("a.yaml", f"format: {FORMAT}\nuser: hi\nexamples: [{{user: a}}]", "examples"),
        ("a.yaml", "- hi", "holds no prompt"),
        ("a.yaml", "user: [", "not readable YAML"),
        ("a.txt", "", "user"),
        ("a.txt", "  \n", "user"),
        ("a.md", "hi", "must end in .yaml"),
    ],
)
def test_a_file_that_is_no_prompt_says_what_is_wrong(tmp_path, name, text, told):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=told):
        load_prompt(tmp_path / name)


def test_a_name_that_is_no_file_is_a_shipped_prompt_or_says_so(tmp_path):
    assert load_prompt(Path("vlm-select-history-1")).fields >= {"history", "target"}
    with pytest.raises(InputError, match="vlm-select-2"):
        load_prompt(Path("vlm-select-9"))
    with pytest.raises(InputError, match="cannot be read"):
        load_prompt(tmp_path / "none.yaml")


def test_planners_that_take_no_prompt_are_not_sent_one_in_silence():
    class Old:
        def __init__(self, client):
            self.client = client

    config = VlmConfig("tests.helpers.fake_vlm:ScriptedVlm", "", prompt=OWN)
    with pytest.raises(InputError, match="takes no `asking`"):
        planner_context("old", Old, config, None)
