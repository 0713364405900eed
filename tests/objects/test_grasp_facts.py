"""What is known of grasping the models is complete, of the models as they are now, and survives the disk."""

from dataclasses import replace
from pathlib import Path

from tools.grasp_model.facts import model_digest, save_facts
from torc.objects.grasp_facts import GraspFact, all_grasp_facts, read_facts
from torc.objects.library import builtin_object_names, load_object

BUILT_IN = builtin_object_names()


def test_every_model_was_measured_as_it_is_now() -> None:
    """If this fails, a model has changed: python -m tools.grasp_model graspable"""
    facts = all_grasp_facts()
    assert tuple(facts) == BUILT_IN
    stale = [name for name in BUILT_IN if facts[name].digest != model_digest(load_object(name))]
    assert stale == []


def test_facts_survive_the_disk(tmp_path: Path) -> None:
    facts = {"a": GraspFact(1.0, 0.333, "00ff"), "b": GraspFact(0.0, 0.0, "1234")}
    save_facts(facts, tmp_path / "facts.json")
    assert read_facts(tmp_path / "facts.json") == facts


def test_a_digest_changes_with_what_decides_a_grasp_only() -> None:
    model = load_object("mug_red")
    digest = model_digest(model)
    assert digest == model_digest(replace(model, visuals=(), description="another"))
    assert digest != model_digest(replace(model, mass_kg=0.1))
    assert digest != model_digest(replace(model, friction=0.1))
    assert digest != model_digest(replace(model, pieces=model.pieces[1:]))
