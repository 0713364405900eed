"""Which trials a comparison on a real robot has, in which order, and what the operator's word does to them."""

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from lab_helpers.operator_by_script import ScriptedOperator
from torc.benchmark.spec import BenchPlanner, find_planner
from torc.errors import InputError
from torc.perception.protocol import Wanted
from torc.records import Capture, Observation
from torc.specs.conditions import Conditions
from torc.specs.trial import PlannerSpec
from torc.vlm.config import VlmConfig, parse_vlm
from torc_lab.bench.judging import UNJUDGED, Verdict, ask_verdict, judged, unjudged
from torc_lab.bench.playing import plan_lab_bench
from torc_lab.scenes.scene import Scene

LAB = SimpleNamespace(conditions=Conditions())
RESULT = {
    "status": "completed",
    "retrieved": True,
    "held_target": True,
    "end": "retrieved",
    "picks": 4,
    "drops": 0,
    "dropped": [],
}


def scene(name):
    depth = np.ones((8, 8), np.float32)
    label = np.zeros((8, 8), np.int16)
    rgb = np.zeros((8, 8, 3), np.uint8)
    observation = Observation(rgb, depth, np.eye(3), np.eye(4), np.zeros(0), 0.0)
    return Scene(name, "lab", Wanted("a mug"), Capture(observation, label))


@pytest.fixture(scope="module")
def planners():
    return [find_planner(PlannerSpec(name), None, False) for name in ("random", "dg-select")]


def order(spec):
    return [(t.problem.name, t.seed, t.planner.label) for t in spec.trials]


def test_the_order_is_random_but_repeats_and_every_round_has_each_planner_once(planners):
    scenes = [scene("cups"), scene("boxes")]
    spec = plan_lab_bench(LAB, scenes, planners, 6)
    assert order(plan_lab_bench(LAB, scenes, planners, 6)) == order(spec)
    assert order(plan_lab_bench(LAB, scenes, planners, 6, order_seed=1)) != order(spec)
    rounds = [order(spec)[k : k + 2] for k in range(0, 24, 2)]
    assert all(Counter(name for _, _, name in r) == {"random": 1, "dg-select": 1} for r in rounds)
    assert len({(problem, seed) for r in rounds for problem, seed, _ in r}) == 12
    assert [r[0][0] for r in rounds] == ["scene-cups"] * 6 + ["scene-boxes"] * 6
    assert {r[0][2] for r in rounds} == {"random", "dg-select"}  # neither always goes first
    # More repeats change nothing of the rounds before.
    assert order(plan_lab_bench(LAB, scenes[:1], planners, 7))[:12] == order(spec)[:12]


def test_what_cannot_be_played_on_a_robot_is_refused(planners):
    with pytest.raises(InputError, match="More than one scene is called cups"):
        plan_lab_bench(LAB, [scene("cups"), scene("cups")], planners, 1)
    with pytest.raises(InputError, match="--repeats"):
        plan_lab_bench(LAB, [scene("cups")], planners, 0)
    with pytest.raises(InputError, match="oracle"):
        plan_lab_bench(LAB, [scene("cups")], [BenchPlanner(PlannerSpec("oracle"))], 1)
    simulated = BenchPlanner(PlannerSpec("vlm-select", VlmConfig(*parse_vlm("simulated:0.9"))))
    with pytest.raises(InputError, match="simulator's truth"):
        plan_lab_bench(LAB, [scene("cups")], [simulated], 1)


def test_another_reference_is_another_problem(planners):
    one, other = scene("cups"), scene("cups")
    assert one.digest == other.digest
    other.reference.observation.depth_m[0, 0] = 2.0
    fresh = Scene("cups", "lab", Wanted("a mug"), other.reference)
    assert fresh.digest != one.digest
    specs = [plan_lab_bench(LAB, [s], planners, 1) for s in (one, fresh)]
    assert specs[0].trials[0].id != specs[1].trials[0].id


@pytest.mark.parametrize(
    ("verdict", "facts"),
    [
        (Verdict(True, True, 3, (), ""), {"retrieved": True, "end": "retrieved", "picks": 3, "drops": 0}),
        (
            Verdict(True, True, 4, (-1, 5), ""),
            {"retrieved": True, "end": "retrieved", "picks": 4, "drops": 2, "dropped": [-1, 5]},
        ),
        # The target is no drop; it ends the trial, as in simulation.
        (
            Verdict(False, True, None, (0, 7), ""),
            {"retrieved": False, "held_target": True, "end": "target lost", "drops": 1, "dropped": [7]},
        ),
        # The robot took something else for it.
        (Verdict(False, False, None, (), ""), {"retrieved": False, "end": "wrong object", "picks": 4}),
    ],
)
def test_what_the_operator_says_stands_where_the_simulator_says_it(verdict, facts):
    waiting = unjudged(RESULT)
    assert waiting["status"] == UNJUDGED
    found = judged(waiting, verdict)
    assert found["status"] == "completed"
    assert "error" not in found
    assert found["felt"] == {k: RESULT[k] for k in RESULT if k != "status"}
    assert {name: found[name] for name in facts} == facts


def test_questions_are_asked_again_until_the_answers_make_sense():
    told = iter(["x", "9", "2"])
    fell = iter(["3,3", "-1", "99", "0", "4,?,?", "4, ?"])
    operator = ScriptedOperator(
        {
            "in the bin": True,
            "With which pick": lambda: next(told),
            "What fell": lambda: next(fell),
            "note": "n",
        }
    )

    def picks():
        return ask_verdict(operator.person, scene("cups"), 4)

    told = iter(["x", "9", "2", ""])
    assert picks() == Verdict(True, True, 4, (-1, -1, 4), "n")
    assert sum("no number from 1 to 4" in line for line in operator.said) == 2
    assert sum("Not numbers" in line for line in operator.said) == 3
    assert sum("cannot both" in line for line in operator.said) == 1
    assert operator.asked("held") == 0
