"""Decisions for frames from anywhere."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from numba import njit

from tests.helpers.fake_episode import ScriptedPlanner
from tests.helpers.fake_vlm import ScriptedVlm
from torc.brain import FrameDecider, answer_text, decide_frame
from torc.brain.answer import STATUS_WORDS, blockers_of, evidence_in_labels, status_counts
from torc.errors import InputError
from torc.pipeline import warm_up
from torc.pipeline.planners import make_planner
from torc.pipeline.warm_up import MESSAGE
from torc.records import Evidence, GraspStatus
from torc.task_planning.dg_select import DgSelectPlanner
from torc.testing.contexts import box, make_context


def test_the_answer_is_in_the_frames_own_labels(frame_of):
    for object_id, label in ((0, 512), (1, 40_000), (7, 7)):
        assert decide_frame(frame_of(), ScriptedPlanner([object_id])).label == label
    assert decide_frame(frame_of(), ScriptedPlanner([None])).label is None


class Compiling(ScriptedPlanner):
    """Compiles something before it chooses."""

    def decide(self, context, rng):
        njit(lambda x: x + 1)(1)
        return super().decide(context, rng)


def test_a_decision_that_compiles_says_so(frame_of, capsys):
    decide_frame(frame_of(), ScriptedPlanner([0]))
    capsys.readouterr()
    decide_frame(frame_of(), ScriptedPlanner([0]))
    assert capsys.readouterr().err == ""
    decide_frame(frame_of(), Compiling([0]))
    assert capsys.readouterr().err == f"{MESSAGE}\n"


def test_a_long_compilation_says_how_far_it_is(capsys, monkeypatch):
    monkeypatch.setattr(warm_up, "_EVERY_S", -1.0)
    with warm_up.announced_compilation():
        njit(lambda x: x + 2)(1)
    first, *others = capsys.readouterr().err.splitlines()
    assert first == MESSAGE
    assert others[0].startswith("  1 kernels after 0 s")


def test_the_same_frame_and_seed_give_the_same_answer(frame_of):
    answers = [decide_frame(frame_of(), seed=4).to_dict() for _ in range(2)]
    for answer in answers:
        del answer["seconds"]
    assert answers[0] == answers[1]


def test_distance_does_not_matter(frame_of):
    """What the camera has seen free is free, however far away it is."""
    near, far = (decide_frame(frame_of(distance_m=d)) for d in (1.0, 6.0))
    assert near.label == far.label
    shares = [1 - a.look.context.volume.seen.mean() for a in (near, far)]
    assert shares[1] == pytest.approx(shares[0], abs=0.05)
    assert min(far.look.context.report.valid_total) > 0


@pytest.mark.parametrize("support_z_m", [1.05, 0.80])
def test_a_robot_works_at_the_table_that_is_seen(frame_of, support_z_m):
    answer = decide_frame(frame_of(support_z_m=support_z_m), robot="sda10f_2f85")
    world = answer.look.world
    table = world.boxes[world.box_names.index("table")]
    assert table[5] == pytest.approx(support_z_m, abs=0.02)
    bin_floor = world.boxes[world.box_names.index("bin_floor")]
    # The rest of the robot's own workspace stands there too.
    assert (bin_floor[5] > 0) == (support_z_m == 1.05)


def test_an_estimated_pose_is_told_and_no_robot_works_by_it(frame_of):
    frame = frame_of()
    estimated = replace(frame, observation=replace(frame.observation, pose_estimated=True))
    told = [decide_frame(f, ScriptedPlanner([0])) for f in (frame, estimated)]
    assert [a.to_dict()["pose_estimated"] for a in told] == [False, True]
    assert ["pose was estimated" in answer_text(a) for a in told] == [False, True]
    for use in (decide_frame, FrameDecider):
        with pytest.raises(InputError, match="pose was estimated from the picture"):
            use(estimated, ScriptedPlanner([0]), robot="sda10f_2f85")


def test_a_choice_that_is_not_in_sight_is_refused(frame_of):
    with pytest.raises(InputError, match="object 23, which is not in sight"):
        decide_frame(frame_of(), ScriptedPlanner([23]))


def test_the_volume_of_one_frame_goes_into_the_next(frame_of):
    first = decide_frame(frame_of())
    second = decide_frame(frame_of(), volume=first.look.context.volume)
    assert second.look.context.volume.snapshots == 2
    assert np.array_equal(first.look.context.volume.seen, second.look.context.volume.seen)


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


def context():
    shapes = (box(0, 0.72, -0.1, (0.06, 0.06, 0.2)), box(1, 0.6, -0.1, (0.06, 0.08, 0.12)))
    return make_context(shapes, valid={1: 2}, blocked={0: [(1,), (1,)]}, unreachable={0: 3})


def test_every_status_is_counted_and_has_words():
    assert set(STATUS_WORDS) == set(GraspStatus)
    assert status_counts(context(), 0) == {GraspStatus.BLOCKED: 2, GraspStatus.UNREACHABLE: 3}
    assert status_counts(context(), 1) == {GraspStatus.VALID: 2}
    assert blockers_of(context(), 0) == {1: 2}
    assert blockers_of(context(), 1) == {}


@pytest.mark.parametrize("chosen", [0, 1, 7])
def test_the_grasps_of_the_choice_are_its_valid_ones_best_first(frame_of, chosen):
    answer = decide_frame(frame_of(), ScriptedPlanner([chosen]))
    p = [grasp.p for grasp in answer.grasps]
    assert p == sorted(p, reverse=True)
    assert len(p) == answer.look.context.report.valid_total[answer.look.context.scene.ids.index(chosen)]
    points = answer.look.context.scene.object(chosen).points
    for grasp in answer.grasps:
        distance = np.linalg.norm(points - grasp.T_world_tcp[:3, 3], axis=1).min()
        assert distance < 0.06  # at the object, and nowhere else
    assert answer.to_dict()["grasps"] == [grasp.to_dict() for grasp in answer.grasps]


IDS = {"0", "1"}
"""Ids that torc gives the labels 512 and 40000."""
PLANNERS = {
    "random": None,
    "dg-select": None,
    "belief": None,
    "vlm-select": '{"plan": [{"action": "remove", "input": 1}]}',
    "vlm-fixes-dg": '{"relations": [{"source": 0, "relation": "below", "target": 7}]}',
}


def planner_of(name: str):
    reply = PLANNERS[name]
    return make_planner(name, **({} if reply is None else {"client": ScriptedVlm([reply])}))


def numbers(value, key: str = "") -> set[str]:
    """Whole numbers that stand for an object: under a key that names one, as a key, or in a sentence."""
    if isinstance(value, dict):
        keys = {k for k in value if k.isdigit()}
        return keys.union(*(numbers(v, k) for k, v in value.items()))
    if isinstance(value, list):
        return set().union(*(numbers(v, key) for v in value))
    if key in ("label", "source", "target", "id", "graspable"):
        return {str(value)}
    return set(re.findall(r"(?<=Pick )\d+|(?<=target )\d+|\d+(?= (?:below|behind))", str(value)))


@pytest.mark.parametrize("target", [512, "hidden"])
@pytest.mark.parametrize("name", PLANNERS)
def test_reasons_and_json_hold_labels_alone(frame_of, name, target):
    labels = {"7", "512", "40000", "23", "hidden"}
    answer = decide_frame(frame_of(target=target), planner_of(name))
    told = json.loads(json.dumps(answer.to_dict()))
    for o in told["objects"]:
        del o["id"]
    found = numbers({k: v for k, v in told.items() if k not in ("exchanges", "seconds")})
    assert found <= labels
    assert "40000" in found
    assert not IDS & set(re.findall(r"Pick (\d+)", answer_text(answer)))


def test_notes_of_a_planner_pass_unchanged():
    notes = {"pixels": {"1": 40}, "graphs": [1, 2]}
    assert evidence_in_labels(Evidence(notes=notes), {0: 512, 1: 40_000}) == notes


def rows(text: str) -> list[list[str]]:
    """Words of the table's lines, the heading first."""
    return [line.replace(">", " ").split() for line in text.split("\n\n")[1].splitlines()]


def test_the_choice_is_given_by_its_label(frame_of):
    answer = decide_frame(frame_of(), ScriptedPlanner([1]))
    assert answer_text(answer).startswith("Pick object 40000.\nWhy: told to pick 1\n")
    x, y, z = answer.grasps[0].T_world_tcp[:3, 3]
    assert f"Best grasp: at ({x:.3f}, {y:.3f}, {z:.3f}) m" in answer_text(answer)
    assert answer_text(decide_frame(frame_of(), ScriptedPlanner([None]))).startswith("No choice.\n")


def test_every_row_has_its_label(frame_of):
    text = answer_text(decide_frame(frame_of(), ScriptedPlanner([1])))
    heading, *found = rows(text)
    assert heading[0] == "object"
    assert [row[0] for row in found if row[0].isdigit()] == ["7", "512", "40000"]
    assert [row[0] for row in found if "target" in row] == ["512"]
    (marked,) = [line for line in text.splitlines() if line.startswith(" >")]
    assert marked.split()[1] == "40000"


def test_no_choice_tells_what_became_of_each_objects_grasps(frame_of):
    text = answer_text(decide_frame(frame_of(), ScriptedPlanner([None])))
    told = text.partition("What became of the grasps of each object:\n")[2]
    starts = [line.split(":")[0].strip() for line in told.splitlines() if line[2].isdigit()]
    assert starts == ["7", "512", "40000"]
    assert "valid" in told
    assert "Best grasp" not in text


@pytest.mark.parametrize("chosen", [7, None])
def test_lines_fit_eighty_columns(frame_of, chosen):
    frame = replace(frame_of(), names={0: "red mug with a long name", 7: "box"})
    text = answer_text(decide_frame(frame, ScriptedPlanner([chosen])))
    assert "red mug" in text
    assert max(map(len, text.splitlines())) <= 80


def test_a_target_that_shows_too_little_is_said_to_be_hidden(frame_of):
    text = answer_text(decide_frame(frame_of(target=23))).replace("\n", " ")
    assert "The target is object 23, shows too little to be found and counts as hidden." in text
    assert "The target is hidden." in answer_text(decide_frame(frame_of(target="hidden")))


def test_warnings_of_the_frame_are_in_text_and_json(frame_of):
    answer = decide_frame(replace(frame_of(), warnings=("Check the pose.",)))
    assert answer.to_dict()["warnings"] == ["Check the pose."]
    assert "Warning: Check the pose." in answer_text(answer)


def test_a_planner_is_a_name_a_class_or_an_object(frame_of):
    frame = frame_of()
    for planner in ("dg-select", DgSelectPlanner, DgSelectPlanner()):
        assert decide_frame(frame, planner).decision.object_id is not None
    with pytest.raises(InputError, match="is not a task planner: pass a name"):
        decide_frame(frame, 3)
