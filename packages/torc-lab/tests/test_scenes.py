"""A scene that is stored and laid out again, behind the twins' wires."""

import time

import numpy as np
import pytest

from lab_helpers.operator_by_script import ScriptedOperator
from torc.errors import InputError
from torc.objects.library import load_object
from torc.perception.protocol import Wanted
from torc.problems.problem import load_problem
from torc.sim.portraits import turn_table
from torc_lab.scenes.laying_out import THRESHOLD, View, lay_out, open_eyes
from torc_lab.scenes.overlay import overlay
from torc_lab.scenes.scene import FACTS, REFERENCE, load_scene, record_scene, save_scene

pytest.importorskip("websockets", reason="websockets is not installed")
pytest.importorskip("pymodbus", reason="pymodbus is not installed")
PROBLEM = "validation-structured-02"


def stored(lab, directory):
    problem = load_problem(PROBLEM)
    wanted = Wanted(problem.description, turn_table(load_object(problem.ordered()[0].model))[:2])
    with open_eyes(lab) as eyes:
        scene, found = record_scene("cups", lab, wanted, eyes, say=lambda text: None)
    save_scene(scene, directory, found=found)
    return load_scene(directory)


class Shown:
    """A screen that somebody watches."""

    def __init__(self):
        self.watched, self.pictures, self.troubles = True, [], []

    def put(self, rgb, facts):
        self.pictures.append((rgb, facts))

    def trouble(self, text):
        self.troubles.append(text)


@pytest.mark.long
def test_what_is_disturbed_falls_below_the_threshold_alone_and_laid_out_again_is_accepted(
    rehearsed, tmp_path
):
    with rehearsed(problem=PROBLEM) as (there, lab):
        scene = stored(lab, tmp_path / "cups")
        assert (tmp_path / "cups" / "seen.png").exists()
        with open_eyes(lab) as eyes:
            view = View(lab, scene, eyes, THRESHOLD)
            assert min(view.measure()[0].objects.values()) > 0.95
            there.world.disturb()
            time.sleep(0.5)
            found, facts = view.measure()
        low = [k for k, value in found.objects.items() if value < THRESHOLD]
        assert len(low) == 1
        assert sorted(found.objects.values())[1] > 0.9
        assert not found.fits(THRESHOLD)
        assert " cm too " in facts[f"object {low[0]}"]
        sent = len(there.arm.heard)
        screen = Shown()

        def person_lays_out():
            time.sleep(1.0)  # beside the screen
            if operator.asked("Lay out") == 2:
                there.world.reset()
                time.sleep(0.5)
            return ""

        operator = ScriptedOperator({"Lay out": person_lays_out})
        layout = lay_out(lab, scene, operator.person, THRESHOLD, screen)
        assert (layout.by, layout.measured) == ("overlap", 2)
        assert layout.facts()["overlap"].keys() == {str(k) for k in scene.ids}
        assert layout.facts()["faults"] == []
        assert any(f"object {low[0]} overlaps by" in line for line in operator.said)
        assert len(there.arm.heard) == sent
        assert {facts["scene"] == "laid out" for _, facts in screen.pictures} == {True, False}
        there.world.disturb()
        by_word = lay_out(lab, scene, ScriptedOperator({"Lay out": "accept"}).person)
        assert by_word.by == "word"
        assert len(by_word.facts()["faults"]) == 1
        assert lay_out(lab, scene, ScriptedOperator({"Lay out": "stop"}).person) is None


@pytest.mark.long
def test_a_stored_scene_is_read_as_it_was_and_a_damaged_one_is_refused(rehearsed, tmp_path):
    directory = tmp_path / "cups"
    with rehearsed(problem=PROBLEM) as (_, lab):
        scene = stored(lab, directory)
        again = load_scene(directory)
        with pytest.raises(InputError, match="--overwrite"):
            stored(lab, directory)
    assert (again.digest, again.ids, again.problem) == (scene.digest, scene.ids, "scene-cups")
    np.testing.assert_array_equal(again.reference.observation.depth_m, scene.reference.observation.depth_m)
    assert [p.shape for p in again.wanted.pictures] == [p.shape for p in scene.wanted.pictures]
    image = overlay(again.reference, again.reference.observation, _all_good(again), THRESHOLD, 640)
    assert image.shape[1] == 640
    text = (directory / FACTS).read_text()
    (directory / FACTS).write_text(text.replace("torc-scene/2", "torc-scene/9"))
    with pytest.raises(InputError, match="format"):
        load_scene(directory)
    (directory / FACTS).write_text("{")
    with pytest.raises(InputError, match="damaged"):
        load_scene(directory)
    (directory / FACTS).write_text(text)
    (directory / REFERENCE).write_bytes(b"no")
    with pytest.raises(InputError, match=r"reference.*is not a readable"):
        load_scene(directory)
    with pytest.raises(InputError, match="torc lab scene"):
        load_scene(tmp_path / "nothing")


def _all_good(scene):
    from torc_lab.scenes.overlap import Overlap

    return Overlap(dict.fromkeys(scene.ids, 1.0), 0, False, 1.0, False)
