"""The tasks of lmms-eval and VLMEvalKit, run by them with recorded replies. Needs scripts/harnesses."""

import json
import os
from pathlib import Path

import pytest

from next_object_helpers.harness_environments import VARIABLE, run_in_harness
from next_object_helpers.tiny_next_object import tiny_replies, tiny_rows, write_tiny
from torc_next_object.harnesses.exporting import export_for
from torc_next_object.prompting import prompt_text
from torc_next_object.replies import read_number
from torc_next_object.scoring import score_answers

MEASURES = ("regret", "regret_low", "regret_high", "top1", "lost", "invalid")
ROWS = tiny_rows(24)
REPLIES = tiny_replies(ROWS)
WANTED = score_answers((row.to_dict(), read_number(REPLIES[row.id], row.numbers)) for row in ROWS).to_dict()


@pytest.fixture
def prepared(tmp_path):
    replies = tmp_path / "replies.json"
    replies.write_text(json.dumps(REPLIES))

    def exported(harness):
        out = tmp_path / harness
        export_for(harness, str(write_tiny(tmp_path / "data", ROWS)), out, "test")
        return out

    return tmp_path, replies, exported


@pytest.mark.long
@pytest.mark.parametrize("variant", ["image", "relations"])
def test_lmms_eval_scores_as_scoring_does_to_the_digit(prepared, variant):
    home, replies, exported = prepared
    arguments = [
        "-m",
        "next_object_helpers.run_lmms_eval",
        f"torc_next_object_{variant}",
        exported("lmms-eval"),
        replies,
    ]
    found = run_in_harness("lmms-eval", [str(a) for a in arguments], home)
    assert {name: found["scores"][name] for name in MEASURES} == {name: WANTED[name] for name in MEASURES}
    by_id = {one["id"]: one for one in found["asked"]}
    for row in ROWS:
        assert by_id[row.id]["text"] == prompt_text(row.to_dict(), variant)
        assert by_id[row.id]["sizes"] == [[32, 24]] * (1 + len(row.references))


@pytest.mark.long
@pytest.mark.parametrize("variant", ["image", "grasps"])
def test_vlmevalkit_scores_as_scoring_does_to_the_digit(prepared, variant):
    home, replies, exported = prepared
    out, kit = exported("vlmevalkit"), Path(os.environ.get(VARIABLE, "")) / "VLMEvalKit"
    arguments = ["-m", "next_object_helpers.run_vlmevalkit", kit / "run.py", f"TorcNextObject_{variant}"]
    found = run_in_harness(
        "vlmevalkit",
        [str(a) for a in (*arguments, replies, home / "work")],
        home,
        more_paths=(out, kit),
        LMUData=str(out),
    )
    assert {name: found["scores"][name] for name in MEASURES} == {name: WANTED[name] for name in MEASURES}
    assert found["scores"]["not_answered"] == 0
    assert found["asked"] == [["image"] * (1 + len(row.references)) + ["text"] for row in ROWS]
