"""Recorded trials as the page gets them; and what strangers may have put there."""

import json
import os
import shutil
from dataclasses import replace

import numpy as np
import pytest

from torc.episode.pick_view import load_view
from torc.episode.recorded import read_trial
from torc.episode.viewer_links import trial_key
from torc.errors import InputError
from torc.records.serialization import save_record
from torc.web.arrays import pack_view
from torc.web.pick_page import pick_page, trial_page, why_not
from torc.web.shelf import Shelf, open_shelf
from torc.web.thumbnails import thumbnail


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
    assert page["picks_left"] == 14


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


def test_a_line_that_is_being_written_is_left_out(trial):
    whole = read_trial(trial)
    with open(trial / "events.jsonl", "a") as log:
        log.write('{"event": "looked", "pi')
    assert read_trial(trial).picks == whole.picks


def test_an_older_trial_without_arrays_is_shown_too(trial):
    for path in (trial / "picks").glob("*_view.npz"):
        path.unlink()
    recorded = read_trial(trial)
    page = pick_page(recorded, 0)
    assert page["arrays"] is False
    assert page["graph"]["target"] == 0
    assert page["objects"][0]["box"] is None
    assert thumbnail(recorded, 0).startswith(b"\xff\xd8")


def test_the_graph_is_the_planners_own_or_that_by_geometry(trial):
    page = pick_page(read_trial(trial), 0)
    assert page["graph_by"] == "the planner"
    lines = _lines(trial)
    for line in lines:
        if line["event"] == "decided":
            line["evidence"] = {}
    _write(trial, lines)
    other = pick_page(read_trial(trial), 0)
    assert other["graph_by"] == "geometry"
    assert [e["route"] for e in other["graph"]["edges"]] == [e["route"] for e in page["graph"]["edges"]]
    assert {n["p"] for n in other["graph"]["nodes"]} == {None}


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


def test_numbers_that_are_none_do_not_reach_the_browser(trial):
    lines = (trial / "events.jsonl").read_text().replace('"rule": "most probable sink"', '"rule": NaN')
    (trial / "events.jsonl").write_text(lines)
    json.dumps(pick_page(read_trial(trial), 0), allow_nan=False)


def test_a_graph_that_is_none_is_left_out(trial):
    far = {"id": 99, "hidden": 0, "valid_grasps": 0, "blocked_grasps": 0}
    many = {"version": 1, "target": 0, "nodes": [{"id": 0}] * 100, "edges": []}
    beyond = {"version": 1, "target": 99, "nodes": [far], "edges": []}
    for graph in ({}, [], 7, {"nodes": 3, "edges": 4}, many, beyond):
        lines = _lines(trial)
        for line in lines:
            if line["event"] == "decided":
                line["evidence"] = {"graph": graph, "probabilities": [1]}
        _write(trial, lines)
        assert pick_page(read_trial(trial), 0)["graph"] is None


@pytest.mark.filterwarnings("ignore:invalid value")
@pytest.mark.usefixtures("any_arrays")
def test_arrays_that_do_not_fit_are_refused(trial):
    path = trial / "picks" / "00_view.npz"
    view = load_view(path)
    unseen, grasps, cloud = view.unseen, view.grasps, view.cloud
    outside = unseen.index.copy()
    outside[0] = 999
    endless = grasps.Ts_world_tcp * np.float32(np.inf)
    for spoilt in (
        {"label_image": view.label_image.astype(np.int64)},
        {"unseen": replace(unseen, index=outside)},
        {"unseen": replace(unseen, hiders=unseen.hiders[:0])},
        {"grasps": replace(grasps, Ts_world_tcp=endless)},
        {"cloud": replace(cloud, rgb=cloud.rgb[:-1])},
        {"objects": (replace(view.objects[0], id=64),)},
    ):
        save_record(replace(view, **spoilt), path)
        with pytest.raises(InputError, match="00_view"):
            load_view(path)


def test_a_bomb_is_not_unpacked(trial):
    path = trial / "picks" / "00_view.npz"
    np.savez_compressed(path, a=np.zeros(80 * 2**20, np.uint8))
    assert path.stat().st_size < 2**20
    with pytest.raises(InputError, match="larger than"):
        load_view(path)


def test_a_picture_must_be_a_plain_png_of_a_modest_size(trial, tmp_path):
    path = trial / "picks" / "00_seen.png"
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


def test_one_trial_is_a_shelf_too(trial):
    (line,) = open_shelf(trial).lines()
    assert line["name"] == "boxes"
    assert Shelf(trial).read(line["key"]).started.problem == "boxes"


def test_an_unreadable_trial_is_listed_with_its_reason(recorded, tmp_path):
    (recorded / "boxes" / "spec.json").write_text("[]")
    (line,) = open_shelf(recorded).lines()
    assert line["status"] == "unreadable"
    assert "spec.json" in line["error"]
    shutil.rmtree(recorded / "boxes")
    for directory, told in ((recorded, "no recorded trial"), (tmp_path / "nowhere", "nowhere")):
        with pytest.raises(InputError, match=told):
            open_shelf(directory)


def test_reasons_come_most_frequent_first(trial):
    o = replace(
        load_view(trial / "picks" / "00_view.npz").objects[0], statuses={"unreachable": 2, "blocked": 5}
    )
    assert why_not(o, {}) == "5 blocked by other objects; 2 out of the arm's reach"
    assert why_not(o, {7: 1, 3: 4}) == "5 blocked by 3 (4), 7 (1); 2 out of the arm's reach"
    assert why_not(replace(o, statuses={}), {}) == "no grasp was found on it"


def test_too_many_trials_are_refused_rather_than_cut_off(recorded, monkeypatch):
    monkeypatch.setattr("torc.episode.recorded.MAX_TRIALS", 0)
    with pytest.raises(InputError, match="further down"):
        open_shelf(recorded)
