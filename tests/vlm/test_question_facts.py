"""What the third questions say beyond the second ones."""

from dataclasses import replace

import numpy as np
import pytest

from tests.helpers.fake_vlm import ScriptedVlm
from torc.errors import InputError
from torc.pipeline.planners import make_planner
from torc.records import GraspStatus, Hand
from torc.robots.loading import load_robot
from torc.testing import contexts
from torc.vlm.config import Asking, VlmConfig
from torc.vlm.prompt_files import shipped_names, shipped_prompt
from torc.vlm.question_facts import grasp_facts, gripper_sentence, target_size_sentence
from torc.vlm.simulated.client import told_facts

DIGESTS = {
    "find-target-1": "6f6d422ce827",
    "vlm-fixes-dg-1": "70a1641ed064",
    "vlm-fixes-dg-2": "98dc35be0bad",
    "vlm-fixes-dg-3": "294ba0ba730b",
    "vlm-grasps-1": "de983ead8c06",
    "vlm-grasps-2": "e3f845993302",
    "vlm-grasps-3": "52d8a49ac50a",
    "vlm-grasps-history-1": "8728a77246a1",
    "vlm-select-1": "5ca7b384563a",
    "vlm-select-2": "bf13daa120f4",
    "vlm-select-3": "77bb5090be6f",
    "vlm-select-history-1": "eecbef2721d3",
}


def _asked(name, context, questions):
    vlm = ScriptedVlm(["?"])
    asking = VlmConfig("gemini", "m", questions=questions).asking
    decision = make_planner(name, client=vlm, asking=asking).decide(context, np.random.default_rng(0))
    return vlm.questions[0], decision


def test_a_shipped_prompt_never_changes():
    """Replies are kept by what was asked: give a changed text the next number."""
    assert {name: shipped_prompt(name).digest[:12] for name in shipped_names()} == DIGESTS


@pytest.mark.parametrize("seed", range(6))
def test_counted_facts_say_the_same_and_every_number_is_the_reports(seed):
    context = contexts.cluttered_context(10, seed)
    lines, report = grasp_facts(context, counted=True), context.report
    assert told_facts("\n".join(lines)) == told_facts("\n".join(grasp_facts(context)))
    for line in lines:
        words = line.replace(".", "").split()
        a, total = int(words[1]), np.count_nonzero(context.grasps.object_ids == int(words[1]))
        if "blocked by" in line:
            i, j = report.object_ids.index(a), report.object_ids.index(int(words[6]))
            assert (int(words[8]), int(words[11])) == (report.blocking[i, j], total)
        elif "graspable" in line:
            valid = report.valid_total[report.object_ids.index(a)]
            assert (int(words[4]), int(words[7])) == (valid, total)
    named = {int(line.split()[1]) for line in lines}
    assert named == set(context.scene.ids)


def test_an_object_without_a_grasp_is_named():
    context = contexts.nothing_graspable_context()
    assert context.graspable_ids == ()
    assert "Object 1 has no grasp, and no object in sight is known to be in its way." in grasp_facts(
        context, counted=True
    )


def test_the_gripper_is_described_by_the_robots_description():
    context = contexts.behind_context()
    assert gripper_sentence(context).startswith("The gripper has two fingers. It reaches in from above.")
    hand = load_robot().gripper.hand
    assert hand.opening_m == pytest.approx(0.085, abs=1e-3)
    assert 0.02 < hand.finger_length_m < 0.12
    said = gripper_sentence(replace(context, hand=Hand(0.08, 0.05)))
    assert "5 cm long, which open to 8.0 cm" in said


def test_the_sides_are_those_of_the_picture():
    context = contexts.behind_context()
    R = context.scene.observation.T_world_camera[:3, :3]
    Ts = context.grasps.Ts_world_tcp.copy()
    level = np.array([*R[:2, 2], 0.0]) / np.linalg.norm(R[:2, 2])
    for direction, words in ((level, "from the camera's side, never"), (-level, "from the far side.")):
        Ts[:, :3, 2] = direction
        reachable = replace(context.report, status=np.full(len(Ts), GraspStatus.VALID, np.uint8))
        said = gripper_sentence(
            replace(context, grasps=replace(context.grasps, Ts_world_tcp=Ts), report=reachable)
        )
        assert words in said
        assert "90 degrees" in said


def test_the_targets_size_is_said_as_it_is_known():
    context = contexts.behind_context()
    assert (
        target_size_sentence(replace(context, target_size_m=(0.112, 0.068)))
        == "It is 11 cm long and 7 cm thick."
    )
    assert "What is in sight of it is" in target_size_sentence(context)
    assert target_size_sentence(contexts.hidden_context()) == ""


@pytest.mark.parametrize("name", ["vlm-select", "vlm-grasps", "vlm-fixes-dg"])
def test_the_versions_differ_in_what_they_are_to_and_old_ones_are_asked_as_ever(name):
    context = replace(contexts.behind_context(), hand=Hand(0.085, 0.04), target_size_m=(0.11, 0.07))
    (old, decided), (new, _) = _asked(name, context, 2), _asked(name, context, 3)
    assert decided.evidence.vlm.prompt == f"{name}-2"
    assert "gripper" not in old.prompt
    for said in (
        "two fingers, 4 cm long, which open to 8.5 cm",
        "11 cm long",
        "A piece of the target may show",
        "blue tuna can",
    ):
        assert said in new.prompt
    assert "win" in new.prompt
    assert "$" not in new.prompt
    assert ("in the way of some of its grasps" in new.prompt) == (name == "vlm-grasps")
    assert old.images != new.images


def test_the_second_questions_are_the_default_and_unknown_ones_are_refused():
    assert Asking().questions == VlmConfig("gemini", "m").questions == 2
    with pytest.raises(InputError, match="there are 2, 3"):
        VlmConfig("gemini", "m", questions=4)
