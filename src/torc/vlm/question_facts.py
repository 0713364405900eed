"""What questions say beyond the picture: how the gripper reaches in, the target's size, what can be grasped."""

import numpy as np

from torc.records import GraspStatus, PlanningContext

_SLANTED_RAD = np.deg2rad(20.0)
_SIDE_SHARE = 0.05
"""A side counts if it has at least this share of the slanted grasps."""
_TOWARDS = 0.5
"""Least cosine of a motion that counts as one in a direction."""


def gripper_sentence(context: PlanningContext) -> str:
    """Say how wide the gripper opens, how long its fingers are, and from where it reaches in."""
    hand = context.hand
    size = (
        "The gripper has two fingers."
        if hand is None
        else f"The gripper has two fingers, {100 * hand.finger_length_m:.0f} cm long, which open to "
        f"{100 * hand.opening_m:.1f} cm: the part of an object that they close on must be narrower."
    )
    return " ".join(part for part in (size, _directions(context)) if part)


def target_size_sentence(context: PlanningContext) -> str:
    """Give the target's size in centimetres: as measured by the user, else of its visible part; empty if unknown."""
    if context.target_size_m is not None:
        length, width = (100 * m for m in context.target_size_m)
        return f"It is {length:.0f} cm long and {width:.0f} cm thick."
    target = next((o for o in context.scene.objects if o.id == context.scene.target_id), None)
    if target is None or len(target.points) < 3:
        return ""
    wide, high = _seen_size_m(np.asarray(target.points, float))
    return f"What is in sight of it is {100 * wide:.0f} cm wide and {100 * high:.0f} cm high."


def grasp_facts(context: PlanningContext, counted: bool = False) -> list[str]:
    """Return "Object C is graspable." and "Object A is blocked by object B.", by rising ids.

    With `counted`, also the numbers of grasps, and the objects without any.
    """
    report, graspable, ids, lines = context.report, context.graspable_ids, context.scene.ids, []
    for i, a in enumerate(report.object_ids):
        if a not in ids:
            continue
        of_it = report.status[context.grasps.object_ids == a]
        if a in graspable:
            free = f"{np.count_nonzero(of_it == GraspStatus.VALID)} of its {len(of_it)} grasps can be carried out now"
            lines.append(f"Object {a} is graspable: {free}." if counted else f"Object {a} is graspable.")
            continue
        by = {b: n for b, n in zip(report.object_ids, report.blocking[i]) if n > 0 and b != a and b in ids}
        for b, n in by.items():
            share = f" in {n} of its {len(of_it)} grasps" if counted else ""
            lines.append(f"Object {a} is blocked by object {b}{share}.")
        if counted and not by:
            lines.append(f"Object {a} has no grasp, and no object in sight is known to be in its way.")
    return lines


def _seen_size_m(points: np.ndarray) -> tuple[float, float]:
    """Return the largest horizontal extent and the height of points, metres."""
    flat = points[:, :2] - points[:, :2].mean(0)
    turns = np.linspace(0, np.pi, 36, endpoint=False)
    along = flat @ np.stack([np.cos(turns), np.sin(turns)])
    return float(np.ptp(along, axis=0).max()), float(np.ptp(points[:, 2]))


def _directions(context: PlanningContext) -> str:
    """Say from where the reachable grasps approach; empty if there are none."""
    reachable = context.report.status != GraspStatus.UNREACHABLE
    approach = context.grasps.Ts_world_tcp[reachable][:, :3, 2]
    if not len(approach):
        return ""
    tilt = np.arccos(np.clip(-approach[:, 2], -1.0, 1.0))
    slanted = approach[tilt > _SLANTED_RAD]
    if not len(slanted):
        return "It reaches in from above."
    most = 5 * round(float(np.rad2deg(np.quantile(tilt, 0.98))) / 5)
    sides = _sides(slanted, context.scene.observation.T_world_camera[:3, :3])
    return f"It reaches in from straight above, or slanted by up to {most} degrees{sides}."


def _sides(approach: np.ndarray, R_world_camera: np.ndarray) -> str:
    """Name the sides of the picture from which slanted grasps approach."""
    forward, right = R_world_camera[:2, 2], R_world_camera[:2, 0]
    if np.linalg.norm(forward) < 0.2:
        return ""
    flat = approach[:, :2] / np.linalg.norm(approach[:, :2], axis=1, keepdims=True)
    ahead, aside = flat @ (forward / np.linalg.norm(forward)), flat @ (right / np.linalg.norm(right))
    shares = {
        "the camera's side": np.mean(ahead > _TOWARDS),
        "the left": np.mean(aside > _TOWARDS),
        "the right": np.mean(aside < -_TOWARDS),
        "the far side": np.mean(ahead < -_TOWARDS),
    }
    named = [side for side, share in shares.items() if share >= _SIDE_SHARE]
    if not named:
        return ""
    never = "" if "the far side" in named else ", never from the far side"
    *most, last = named
    return f", from {', '.join(most)}{' or ' if most else ''}{last}{never}"
