"""Problems of imported scenes say where they come from; labels follow the rules."""

from dataclasses import replace

import numpy as np
from settled_scenes import OBJECTS, QUICK, settled

from tests.helpers.graspclutter6d_tree import TreeObject, upright
from torc.generation.graspclutter6d.problems import category_of, make_problem
from torc.geometry.transforms import make_pose, rotation_about
from torc.problems.problem import parse_problem, problem_text


def test_a_problem_says_where_it_comes_from_and_survives_the_disk(tmp_path):
    scene = settled(tmp_path / "tree", OBJECTS)
    problem = make_problem(scene, "obj_000044_1", 0.254, QUICK, facts={"target_by": "the paper"})
    assert problem.name == "gc6d-249-obj_000044_1"
    assert problem.category == "structured"
    assert problem.description == "the can of peaches"
    assert problem.target == "obj_000044_1"
    assert "25% of the target is in sight" in problem.notes
    assert "2 objects like the target" in problem.notes
    assert problem.origin["scene"] == 249
    assert problem.origin["placement"] == "torc"
    assert "CC-BY-SA" in problem.origin["licence"]
    assert problem.origin["target_by"] == "the paper"
    assert parse_problem(problem_text(problem)) == problem


def test_the_label_is_the_users_else_the_published_one_else_computed(tmp_path):
    scene = settled(tmp_path / "tree", OBJECTS)
    assert category_of(scene) == ("structured", "the authors' label")
    assert category_of(replace(scene, scene=30))[0] == "unstructured"
    unknown = replace(scene, scene=5000)
    assert category_of(unknown) == ("structured", "most objects' resting pose")
    leaning = [
        replace(scene.annotated[n], wxyz=(np.cos(0.2), np.sin(0.2), 0.0, 0.0))
        for n in list(scene.annotated)[:2]
    ]
    half = replace(unknown, annotated=scene.annotated | {o.name: o for o in leaning})
    assert category_of(half)[0] == "unstructured"
    by_user = make_problem(scene, "obj_000017_0", 1.0, QUICK, "unstructured")
    assert (by_user.category, by_user.origin["category_by"]) == ("unstructured", "the user")


def test_lying_on_a_side_is_a_natural_pose_too(tmp_path):
    lying = [
        TreeObject(o.object_id, make_pose(rotation_about((1, 0, 0), np.pi / 2)) @ o.T_table_mesh)
        for o in OBJECTS[:1]
    ]
    scene = settled(tmp_path / "tree", (*lying, upright(44, 0.2, 0.1), upright(44, 0.2, -0.1)), scene=2000)
    assert category_of(scene)[0] == "structured"
