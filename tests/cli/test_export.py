"""`torc export` as a user meets it."""

import json

import pytest
from torc_command import run_torc

from tests.helpers.fake_episode import ScriptedPlanner
from tests.helpers.fake_trial import play_fake_trial
from torc.specs.trial import TrialSpec


@pytest.fixture(scope="module")
def trial(tmp_path_factory):
    directory = tmp_path_factory.mktemp("runs") / "boxes"
    play_fake_trial(TrialSpec.of("boxes", "scripted"), directory, ScriptedPlanner([1, 0]))
    return directory


def test_it_says_what_it_wrote(trial, tmp_path, capsys):
    code, out, _ = run_torc("export", trial, "--out", tmp_path / "a", "--test-share", "0", capsys=capsys)
    assert code == 0
    assert out.splitlines()[0] == "train  2 examples"
    code, out, _ = run_torc(
        "export", trial, "--out", tmp_path / "b", "--test-share", "0", "--json", capsys=capsys
    )
    assert code == 0
    assert json.loads(out) == json.loads((tmp_path / "b" / "export.json").read_text())
    assert json.loads(out)["examples"] == {"train": 2, "test": 0}


def test_what_cannot_be_done_is_bad_input_with_a_remedy(trial, tmp_path, capsys):
    cases = {
        "is no export, so nothing replaces it": (trial, "--out", trial, "--overwrite"),
        "--trajectory": (trial, "--format", "lerobot", "--out", tmp_path / "out"),
        "oracle": (trial, "--format", "pairs", "--out", tmp_path / "out"),
        "nowhere' is not a directory": (tmp_path / "nowhere", "--out", tmp_path / "out"),
        "is not a directory": (trial / "events.jsonl", "--out", tmp_path / "out"),
        "from 0 to 1": (trial, "--out", tmp_path / "out", "--test-share", "2"),
    }
    for word, arguments in cases.items():
        code, out, err = run_torc("export", *arguments, capsys=capsys)
        assert (code, out) == (2, "")
        assert word in err
    assert list(tmp_path.iterdir()) == []
