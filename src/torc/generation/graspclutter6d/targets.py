"""Which object of a settled scene is to be retrieved: the one a user means, or one that makes a problem."""

from collections import Counter

from torc.errors import InputError
from torc.generation.graspclutter6d.published import parse_object_name
from torc.generation.graspclutter6d.settling import SceneFailure, SettledScene
from torc.generation.inspection import Inspector, SceneView


def find_target(scene: SettledScene, wanted: str) -> str | SceneFailure:
    """The name of the object that a user means by "44_1", "obj_000044_1" or "44".

    Raises:
        InputError: it is not in the scene, or several are meant.
    """
    object_id, instance = parse_object_name(wanted)
    names = [n for n in scene.annotated if parse_object_name(n)[0] == object_id]
    if instance is not None:
        names = [n for n in names if parse_object_name(n)[1] == instance]
    if not names:
        raise InputError(f"Scene {scene.scene} has no object {wanted}. It has: {', '.join(scene.annotated)}.")
    if len(names) > 1:
        raise InputError(
            f"Scene {scene.scene} has object {wanted} {len(names)} times: say which: {', '.join(names)}."
        )
    if names[0] in scene.fell:
        return SceneFailure(
            scene.scene, names[0], "the target fell off the table while settling", scene.notes
        )
    return names[0]


def choose_target(scene: SettledScene, view: SceneView, inspector: Inspector) -> str | SceneFailure:
    """The least visible object that makes a problem by the paper's rules; ties go by file order.

    It and all objects around it (in front, within 15 cm beside, taller) can be grasped when they stand alone, or it
    could never be retrieved; and it cannot be grasped at once, or there would be nothing to solve.
    """
    graspable: dict[str, bool] = {}

    def can_grasp(name: str) -> bool:
        if name not in graspable:
            graspable[name] = inspector.graspable_at_all(scene.problem, name)
        return graspable[name]

    outcomes: Counter[str] = Counter()
    for name in sorted((o.name for o in scene.problem.objects), key=view.fraction):
        if not all(can_grasp(other) for other in (name, *inspector.around(scene.problem, name).all)):
            outcomes["cannot be retrieved"] += 1
        elif inspector.graspable_at_first(view, name):
            outcomes["can be picked at once"] += 1
        else:
            return name
    told = ", ".join(f"{count} {what}" for what, count in outcomes.items())
    reason = f"no object makes a problem: {told}; name one with --target to have it all the same"
    return SceneFailure(scene.scene, None, reason, scene.notes)
