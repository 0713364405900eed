"""Marks that mean nothing: a look with new object ids, drawn for one decision alone."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from torc import PlanningContext
from torc.records import TARGET_ID, GraspReport, SegmentedScene


def drawn_numbers(ids: tuple[int, ...], rng: np.random.Generator) -> dict[int, int]:
    """A number for each visible object: the target keeps its own, the others get 1, 2, ... in an order that is drawn.
    (A problem's ids follow its file, where what hides the target may stand first; and ids that are missing would tell
    how many objects are out of sight, or gone.)
    """
    others = [k for k in ids if k != TARGET_ID]
    drawn = {int(k): n for n, k in enumerate(rng.permutation(others), start=1)} if others else {}
    return drawn | ({TARGET_ID: TARGET_ID} if TARGET_ID in ids else {})


def renumbered(context: PlanningContext, numbers: Mapping[int, int]) -> PlanningContext:
    """What prompts and pictures are made from, with these ids for all visible objects: scene, grasps' owners, and who
    blocks whom. The volume and the grasps' blockers keep the old ids.
    """
    owners = np.array([numbers.get(k, k) for k in context.grasps.object_ids.tolist()], np.int16)
    return replace(
        context,
        scene=_scene(context.scene, numbers),
        grasps=replace(context.grasps, object_ids=owners),
        report=_report(context.report, numbers),
    )


def _scene(scene: SegmentedScene, numbers: Mapping[int, int]) -> SegmentedScene:
    label = scene.label_image.copy()
    for old, new in numbers.items():
        label[scene.label_image == old] = new
    objects = sorted((replace(o, id=numbers[o.id]) for o in scene.objects), key=lambda o: o.id)
    return replace(scene, label_image=label, objects=tuple(objects))


def _report(report: GraspReport, numbers: Mapping[int, int]) -> GraspReport:
    known = [i for i, k in enumerate(report.object_ids) if k in numbers]
    order = sorted(known, key=lambda i: numbers[report.object_ids[i]])
    return replace(
        report,
        object_ids=tuple(numbers[report.object_ids[i]] for i in order),
        blocking=report.blocking[np.ix_(order, order)],
        blocked_total=report.blocked_total[order],
        valid_total=report.valid_total[order],
    )
