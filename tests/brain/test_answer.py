"""Answers as JSON and pictures."""

import json

from tests.helpers.fake_episode import ScriptedPlanner
from torc.brain import decide_frame


def test_json_tells_the_label_of_every_id(frame_of):
    answer = json.loads(json.dumps(decide_frame(frame_of()).to_dict()))
    assert {o["id"]: o["label"] for o in answer["objects"]} == {0: 512, 1: 40_000, 7: 7}
    assert answer["label"] in (7, 512, 40_000)
    assert answer["left_out"] == [23]
    blockers = {int(k) for o in answer["objects"] for k in o["blocked_by"]}
    assert blockers <= {7, 512, 40_000}
    assert all(o["valid_grasps"] == o["grasps"].get("valid", 0) for o in answer["objects"])


def test_pictures_are_of_what_the_planner_saw_and_of_its_graph(frame_of, tmp_path):
    decide_frame(frame_of()).save_pictures(tmp_path)
    assert {p.name for p in tmp_path.glob("*.png")} == {"seen.png", "graph.png"}
    (tmp_path / "graph.png").unlink()
    decide_frame(frame_of(), ScriptedPlanner([7])).save_pictures(tmp_path)
    assert {p.name for p in tmp_path.glob("*.png")} == {"seen.png"}
