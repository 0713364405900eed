"""Recorded trials as the page gets them; and what strangers may have put there."""

import json
import os
import shutil
from dataclasses import replace

import numpy as np
import pytest

from torc.drawing.palette import object_color
from torc.errors import InputError
from torc.io.record_files import save_record
from torc.records import TARGET_ID
from torc.trials.recorded import read_trial
from torc.trials.viewer_links import trial_key
from torc.web.app import thumbnail
from torc.web.frames import pack_view
from torc.web.pick_page import find_tags, pick_page, trial_page
from torc.web.shelf import open_shelf


@pytest.fixture
def trial(recorded):
    return recorded / "boxes"


def _lines(trial):
    return [json.loads(line) for line in (trial / "events.jsonl").read_text().splitlines()]


def _write(trial, lines):
    (trial / "events.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))


def test_the_page_tells_what_the_log_tells(trial):
    found = trial_page(read_trial(trial))
    assert [(p["chosen"], p["result"]) for p in found["picks"]] == [(1, "removed"), (0, "retrieved")]
    assert found["result"]["retrieved"] is True
    assert found["names"] == ["thing 0", "thing 1", "thing 2"]
    page = pick_page(read_trial(trial), 1)
    looked = next(line for line in _lines(trial) if line["event"] == "looked" and line["pick"] == 1)
    assert {o["id"]: o["valid"] for o in page["objects"]} == {
        o["id"]: looked["valid_grasps"][str(o["id"])] for o in looked["objects"]
    }
    assert [o["id"] for o in page["objects"] if o["graspable"]] == looked["graspable"]
    assert page["max_picks"] == 15


def test_ids_of_perceptions_own_have_the_right_names_and_the_target_its_mark(trial):
    lines = _lines(trial)
    for line in lines:
        if line["event"] == "looked":
            line |= {"true_ids": {"1": 0, "2": -1}, "target_id": 1, "target_visible": True}
    _write(trial, lines)
    objects = {o["id"]: o for o in pick_page(read_trial(trial), 0)["objects"]}
    assert {k: o["name"] for k, o in objects.items()} == {1: "thing 0", 2: ""}
    assert [k for k, o in objects.items() if o["target"]] == [1]
    assert objects[1]["color"] == "#{:02x}{:02x}{:02x}".format(*object_color(TARGET_ID))


def test_boxes_hold_the_labels(trial):
    recorded = read_trial(trial)
    label = recorded.view(0).label_image
    for o in pick_page(recorded, 0)["objects"]:
        left, top, right, bottom = o["box"]
        inside = label[top : bottom + 1, left : right + 1]
        assert np.count_nonzero(inside == o["id"]) == np.count_nonzero(label == o["id"]) == o["pixels"]


def test_while_a_person_decides_only_a_planners_knowledge_is_told(trial):
    (trial / "result.json").unlink()
    lines = [line for line in _lines(trial) if line["event"] != "ended"]
    for line in lines:
        if line["event"] == "executed":
            line |= {"dropped": [2], "held_id": 2, "detail": "touched thing 2", "result": "slipped"}
            line["felt"] = {"result": "removed", "held_after_lift": True, "delivered": True}
    _write(trial, lines)
    text = json.dumps([trial_page(read_trial(trial)), pick_page(read_trial(trial), 1)])
    assert "removed" in text
    for privileged in ("thing 2", "dropped", "held_id", "slipped"):
        assert privileged not in text


def test_packed_arrays_come_out_as_they_went_in(trial):
    view = read_trial(trial).view(0)
    packed = pack_view(view)
    length = int.from_bytes(packed[:4], "little")
    header = json.loads(packed[4 : 4 + length])
    found = {}
    for a in header["arrays"]:
        assert (4 + length + a["offset"]) % 8 == 0
        count = int(np.prod(a["shape"]))
        flat = np.frombuffer(packed, "<" + a["type"], count, 4 + length + a["offset"])
        found[a["name"]] = flat.reshape(a["shape"])
    np.testing.assert_array_equal(found["labels"], view.label_image)
    np.testing.assert_array_equal(found["points"], view.cloud.points)
    np.testing.assert_array_equal(found["voxels"], view.unseen.index)
    low, high = found["hiders"][:, 0].astype(np.uint64), found["hiders"][:, 1].astype(np.uint64)
    np.testing.assert_array_equal(low | high << np.uint64(32), view.unseen.hiders)


def test_a_log_that_is_none_is_refused_with_its_line(trial):
    for text in (
        "nonsense",
        '{"event": "boom"}',
        '{"event": "executed", "pick": 0, "result": "x", "object_id": 99999}',
        '{"event": "decided", "pick": 0, "object_id": 1, "reason": "x", "evidence": ' + '{"a":' * 99999,
        '{"event": "decided", "pick": 0, "object_id": 1, "reason": 7}',
        '{"event": "executed", "pick": 1000000000, "result": "x", "object_id": 1}',
    ):
        (trial / "events.jsonl").write_text(text + "\n")
        with pytest.raises(InputError, match="line 1"):
            read_trial(trial)


def test_a_picture_must_be_a_plain_png_of_a_modest_size(trial, tmp_path):
    path = trial / "picks" / "00_seen.png"
    (trial / "picks" / "00_plain.png").unlink()  # as in trials of older versions
    png = path.read_bytes()
    path.write_bytes(png[:16] + (60000).to_bytes(4, "big") * 2 + png[24:])
    with pytest.raises(InputError, match="too large"):
        thumbnail(read_trial(trial), 0)
    path.write_bytes(b"<script>alert(1)</script>")
    with pytest.raises(InputError, match="no PNG"):
        read_trial(trial).picture(0)
    path.rename(tmp_path / "secret.png")
    path.symlink_to(tmp_path / "secret.png")
    with pytest.raises(InputError, match="link"):
        read_trial(trial).picture(0)


def test_the_page_gets_the_camera_s_own_picture_and_the_places_of_the_tags(trial):
    recorded = read_trial(trial)
    page, view = pick_page(recorded, 0), recorded.view(0)
    assert page["plain"] is True
    assert recorded.plain_picture(0) != recorded.picture(0)
    for o in page["objects"]:
        assert o["tag"] == find_tags(view.label_image, [1, 2], outlines=True)[o["id"]]
    (trial / "picks" / "00_plain.png").unlink()
    older = pick_page(recorded, 0)
    assert older["plain"] is False
    tags = find_tags(view.label_image, [1, 2], outlines=False)
    assert [o["tag"] for o in older["objects"]] == [tags[o["id"]] for o in older["objects"]]


def test_the_page_knows_what_is_likely_once_free_unless_the_recording_is_older(trial):
    recorded = read_trial(trial)
    for o in pick_page(recorded, 0)["objects"]:
        assert 0 <= o["likely_if_free"] <= o["blocked"]
    view = recorded.view(0)
    older = replace(view, objects=tuple(replace(o, likely_if_free=None) for o in view.objects))
    save_record(older, trial / "picks" / "00_view.npz")
    assert {o["likely_if_free"] for o in pick_page(recorded, 0)["objects"]} == {None}


def test_a_shelf_finds_trials_at_any_depth_and_prefers_what_is_complete(recorded):
    os.makedirs(recorded / "a" / "b")
    (recorded / "boxes").rename(recorded / "a" / "b" / "boxes")
    remains = recorded / "a" / "b" / "boxes.partial"
    remains.mkdir()
    (remains / "events.jsonl").write_text("")
    (line,) = open_shelf(recorded).lines()
    assert line["name"] == "a/b/boxes"
    assert line["status"] == "completed"
    assert line["key"] == trial_key("a/b/boxes") == trial_key("a/b/boxes.partial")


def test_an_unreadable_trial_is_listed_with_its_reason(recorded, tmp_path):
    (recorded / "boxes" / "spec.json").write_text("[]")
    (line,) = open_shelf(recorded).lines()
    assert line["status"] == "unreadable"
    assert "spec.json" in line["error"]
    shutil.rmtree(recorded / "boxes")
    for directory, told in ((recorded, "no recorded trial"), (tmp_path / "nowhere", "nowhere")):
        with pytest.raises(InputError, match=told):
            open_shelf(directory)
