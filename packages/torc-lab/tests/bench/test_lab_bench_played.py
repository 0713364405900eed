"""Task planners against each other behind the twins' wires, with an operator by script."""

import json
import time

import pytest

from lab_helpers.operator_by_script import ScriptedOperator
from torc.benchmark.reading import read_table
from torc.benchmark.spec import find_planner
from torc.benchmark.store import Store
from torc.episode.simulated import pictured_target
from torc.problems.problem import load_problem
from torc.specs.trial import PlannerSpec
from torc_lab.bench.playing import LabBench, plan_lab_bench
from torc_lab.scenes.laying_out import open_eyes
from torc_lab.scenes.scene import record_scene

pytest.importorskip("websockets", reason="websockets is not installed")
pytest.importorskip("pymodbus", reason="pymodbus is not installed")
PROBLEM = "validation-structured-02"


def scene_of(lab):
    wanted = pictured_target(load_problem(PROBLEM))
    with open_eyes(lab) as eyes:
        return record_scene("cups", lab, wanted, eyes, say=lambda text: None)[0]


@pytest.mark.long
def test_two_planners_in_a_scene_interrupted_and_gone_on_with(rehearsed, patient, tmp_path):
    def lays_out():
        there.world.reset()
        time.sleep(0.5)
        return ""

    def interrupted():
        raise KeyboardInterrupt

    answers = {
        "Lay out": lays_out,
        "Is ": lambda: there.world.truth().retrieved,
        "With which pick": "",
        "held in the hand": False,
        "What fell": lambda: ",".join("?" for _ in there.world.truth().dropped),
        "Anything else": "a scripted operator",
    }
    with rehearsed(problem=PROBLEM, max_picks=1) as (there, lab):
        scene = scene_of(lab)
        planners = [find_planner(PlannerSpec(name), None, False) for name in ("random", "dg-select")]
        spec, store = plan_lab_bench(lab, [scene], planners, 1), Store(tmp_path / "real")
        store.extend(spec, {})

        def play(operator):
            scenes = {scene.problem: scene}
            with store.locked():
                return LabBench(lab, store, spec, scenes, operator.person, "pick").play()

        # Ctrl-C while the operator is asked what came of it: that is asked again, and nothing is played again.
        first = ScriptedOperator({"The robot begins": True, "Go?": True, **answers, "Is ": interrupted})
        with pytest.raises(KeyboardInterrupt):
            play(first)
        assert len(store.left(spec)) == 2
        # Ctrl-C within a motion of the next one: it is not scored.
        stopped = ScriptedOperator(
            {"Do you know": True, "The robot begins": True, "Go?": interrupted, **answers}
        )
        with pytest.raises(KeyboardInterrupt):
            play(stopped)
        done, left = spec.trials
        assert [t.id for t in store.left(spec)] == [left.id]
        assert stopped.asked("Lay out") == 1
        kept = (store.directory(done) / "result.json").read_bytes()
        # Whoever does not let it begin sees nothing move.
        sent = len(there.arm.heard)
        assert play(ScriptedOperator({"The robot begins": False, **answers})) == 0
        assert len(there.arm.heard) == sent
        last = ScriptedOperator({"The robot begins": True, "Go?": True, **answers})
        assert play(last) == 1
        assert store.left(spec) == []
        assert (store.directory(done) / "result.json").read_bytes() == kept
        assert last.asked("Lay out") == 1
    assert first.asked("Go?") >= 1
    for trial in spec.trials:
        result = json.loads((store.directory(trial) / "result.json").read_text())
        assert result["status"] == "completed"
        assert result["layout"]["accepted_by"] == "overlap"
        assert result["told"]["note"] == "a scripted operator"
        assert result["felt"].keys() >= {"retrieved", "drops"}
        assert result["drops"] == len(result["dropped"])
    # Who judges is not told who plays.
    assert not any(
        "dg-select" in line or "random" in line for line in [*first.said, *last.said, *first.questions]
    )
    rows = read_table(store.root).rows
    assert [(r.problem, r.category, r.completed) for r in rows] == [("scene-cups", "real", True)] * 2
