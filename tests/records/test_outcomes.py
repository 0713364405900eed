"""What a robot knows of a pick, and what only the simulator does."""

import json

import pytest

from torc.errors import InputError
from torc.io import results
from torc.io.results import check_place, claim, write_json
from torc.records import FeltOutcome, PickOutcome, PickResult, Touch

TOUCH = Touch((0.1, 0.2), 0.05)


def test_a_robot_knows_what_it_felt_and_how_its_arm_was():
    truth = PickOutcome(
        PickResult.SLIPPED,
        3,
        held_id=5,
        held_after_lift=True,
        dropped=(5, 6),
        target_lost=True,
        detail="finger on object 5",
        duration_s=9.0,
        at_home=False,
        touch=TOUCH,
        felt=FeltOutcome(PickResult.REMOVED, True, True),
    )
    told = PickOutcome(PickResult.REMOVED, 3, 3, True, True, duration_s=9.0, at_home=False, touch=TOUCH)
    assert truth.as_felt == told
    assert told.as_felt == told


def test_json_replaces_a_file_and_leaves_nothing_else(tmp_path):
    path = tmp_path / "a.json"
    for value in (1, {"b": [2, "ü"]}):
        write_json(path, value)
        assert json.loads(path.read_text()) == value
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]
    with pytest.raises(TypeError):
        write_json(path, [1, object()])
    assert json.loads(path.read_text()) == {"b": [2, "ü"]}


def _check(out, overwrite=True):
    check_place(out, overwrite, "log.txt", "trial")


def test_new_and_empty_directories_and_those_of_the_kind_may_be_taken(tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "kind").mkdir()
    (tmp_path / "kind" / "log.txt").write_text("")
    for name in ("new", "empty", "kind"):
        _check(tmp_path / name)
    _check(tmp_path / "new", overwrite=False)
    with pytest.raises(InputError, match="add --overwrite to replace it"):
        _check(tmp_path / "kind", overwrite=False)


@pytest.mark.parametrize("overwrite", [True, False])
def test_nothing_else_is_replaced_whatever_is_asked_for(tmp_path, overwrite):
    kind = tmp_path / "kind"
    kind.mkdir()
    (kind / "log.txt").write_text("")
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "thesis.txt").write_text("")
    (tmp_path / "file").write_text("")
    (tmp_path / "link").symlink_to(kind)
    (tmp_path / "dead").symlink_to(tmp_path / "nowhere")
    for name in ("thesis", "file", "link", "dead"):
        with pytest.raises(InputError, match="is no trial, so nothing replaces it"):
            _check(tmp_path / name, overwrite)


def _claim(directory):
    return claim(directory, "log.txt", "trial")


def test_a_directory_that_is_written_is_nobody_elses(tmp_path):
    mine = _claim(tmp_path / "a" / "trial")
    mine.write("so far")
    mine.flush()
    with pytest.raises(InputError, match="Another process is writing"):
        _claim(tmp_path / "a" / "trial")
    assert (tmp_path / "a" / "trial" / "log.txt").read_text() == "so far"
    mine.close()
    _claim(tmp_path / "a" / "trial").close()
    assert (tmp_path / "a" / "trial" / "log.txt").read_text() == ""


def test_what_a_killed_process_left_is_removed_as_a_whole(tmp_path, monkeypatch):
    left = tmp_path / "trial"
    _claim(left).close()
    (left / "picks" / "deep").mkdir(parents=True)
    (left / "result.json").write_text("{}")
    (tmp_path / "kept.txt").write_text("")
    (left / "link").symlink_to(tmp_path)
    with monkeypatch.context() as interrupted:  # in the middle
        interrupted.setattr(results.shutil, "rmtree", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            _claim(left)
    _claim(left).close()
    assert [path.name for path in left.iterdir()] == ["log.txt"]
    assert (tmp_path / "kept.txt").is_file()
