"""Check every device of a laboratory, one by one."""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from typing import Any, cast

import cv2
import numpy as np

from torc import InputError, TorcError
from torc.records import as_capture
from torc.registry.loading import blamed
from torc_lab.calibration.marker import MOVED_M, is_calibrated, marker_of_lab, marker_shift_m
from torc_lab.cameras.kinds import open_camera
from torc_lab.cameras.poses import placed
from torc_lab.checking_motions import Finding, check_motions
from torc_lab.devices import (
    close_arm,
    close_camera,
    close_gripper,
    connect_arm,
    connect_gripper,
    is_at_rest_pose,
    is_ready,
    limits,
)
from torc_lab.identity import check_standing
from torc_lab.lab_file import Lab
from torc_lab.person import Ask
from torc_lab.protocols import (
    ArmDriver,
    GripperDriver,
    LabError,
    NeedsActivation,
    PowersServos,
    state_faults,
)
from torc_lab.robotiq.gripper import RobotiqGripper
from torc_lab.supervisor import SupervisorConfig

_WATCH_S, _POWERED_S, _APART_S = 1.0, 0.5, 0.5
_LEAST_READ = 0.5
_MOST_OFF_M, _MOST_TILT_RAD = 0.01, 0.02


def check_lab(lab: Lab, ask: Ask | None = None) -> Iterator[Finding]:
    """Try every device of a lab file. Nothing moves without `ask`, which is called before each small motion."""
    yield from _tried("arm", lambda: connect_arm(lab), lambda arm: _arm(lab, arm, ask), close_arm)
    yield from _tried(
        "gripper", lambda: connect_gripper(lab), lambda gripper: _gripper(lab, gripper, ask), close_gripper
    )
    yield from _tried(
        "camera", lambda: open_camera(lab.conditions), lambda camera: _camera(lab, camera), close_camera
    )


def _tried(
    what: str,
    connect: Callable[[], Any],
    look: Callable[[Any], Iterator[Finding]],
    close: Callable[[Any], None],
) -> Iterator[Finding]:
    """Yield the findings of a look at a device; an error ends it and becomes a finding."""
    try:
        with ExitStack() as stack, blamed(f"The {what}'s driver", LabError, "Mend the driver."):
            device = connect()
            stack.callback(close, device)
            for finding in look(device):
                yield replace(finding, device=what)
    except TorcError as error:
        yield Finding(str(error), False, what)


def _arm(lab: Lab, arm: ArmDriver, ask: Ask | None) -> Iterator[Finding]:
    if broken := state_faults(arm):
        yield from (Finding(f"its driver breaks a rule: {rule}", False) for rule in broken)
        return
    if (
        ask is not None
        and isinstance(arm, PowersServos)
        and arm.status().stopped
        and ask(f"{arm.name}: power the servos and let motions in?")
    ):
        arm.enable()
        time.sleep(_POWERED_S)
    yield _rates(arm)
    status = arm.status()
    yield Finding(status.stopped or "may move", not status.stopped)
    yield from _standing(lab, arm)
    yield from _joints(lab, status.qpos)
    if is_at_rest_pose(lab, status.qpos):
        yield Finding("at its rest pose")
    else:
        yield Finding("not at its rest pose: `torc retrieve` begins there")
    if arm.feels_contact:
        yield Finding("feels contacts")
    else:
        yield Finding(
            "feels no contacts: approaches are slow, grasps keep further away, and nobody but you stops it"
        )
    if ask is not None and not status.stopped:
        yield from check_motions(lab, arm, ask)


def _standing(lab: Lab, arm: ArmDriver) -> Iterator[Finding]:
    """Yield where the arm's base is modelled, and which fixed joints could not be compared with the model."""
    arm_description = lab.robot.arm
    base = arm_description.T_world_base
    x, y, z = (base @ arm_description.Ts_parent_joint[0])[:3, 3]
    turned = np.rad2deg(np.arctan2(base[1, 0], base[0, 0]))
    yield Finding(
        f"its first joint is modelled at x {x:.3f}, y {y:.3f}, z {z:.3f} m of the world frame, that of table, bin "
        f"and camera, and its base turned by {turned:.0f} degrees about z: measure whether it stands there"
    )
    for name in check_standing(arm_description, arm, lab.held_joints):
        yield Finding(f"nobody reports {name}, which the robot description has in a fixed place", False)


def _joints(lab: Lab, qpos: np.ndarray) -> Iterator[Finding]:
    """Yield the joint positions, and whether they are within the limits."""
    arm, within = lab.robot.arm, limits(lab)
    each = zip(arm.joint_names, qpos, arm.lower, arm.upper, strict=True)
    text = ", ".join(f"{name} {q:.3f} ({lower:.3f} to {upper:.3f})" for name, q, lower, upper in each)
    inside = bool(((qpos >= within.lower) & (qpos <= within.upper)).all())
    yield Finding(
        f"joints {text} rad{'' if inside else ': outside of their limits, or nearer to them than safety.margin_rad'}",
        inside,
    )


def _rates(arm: ArmDriver) -> Finding:
    """Return how often the arm reports its state, and how old the states are."""
    stamps, oldest, began = set(), 0.0, time.monotonic()
    while (now := time.monotonic()) - began < _WATCH_S:
        stamp = arm.status().stamp_s
        stamps.add(stamp)
        oldest = max(oldest, now - stamp)
        time.sleep(0.002)
    stale = SupervisorConfig().stale_s
    often = f"{len(stamps) / _WATCH_S:.0f} times a second, at most {oldest * 1e3:.0f} ms old"
    text = f"{arm.name} tells its state {often}"
    good = oldest < stale
    return Finding(text if good else f"{text}: too old, {stale * 1e3:.0f} ms is the most", good)


def _gripper(lab: Lab, gripper: GripperDriver, ask: Ask | None) -> Iterator[Finding]:
    name = getattr(gripper, "name", type(gripper).__name__)
    ready = is_ready(gripper)
    if not ready and ask is not None and ask(f"{name}: activate? Its fingers open and close all the way."):
        cast(NeedsActivation, gripper).activate()
        ready = is_ready(gripper)
    yield Finding(f"{name} is {'ready' if ready else 'not activated: add --move'}", ready)
    width_m, wanted_m = gripper.max_width_m, lab.robot.gripper.max_width_m
    yield Finding(
        f"max_width_m is {width_m:.3f}; in the robot description it is {wanted_m:.3f}",
        abs(width_m - wanted_m) < 0.002,
    )
    if not ready:
        return
    state = gripper.state
    yield Finding(f"{state.width_m * 1e3:.0f} mm open" + (", holds something" if state.holding else ""))
    if (
        ask is not None
        and isinstance(gripper, RobotiqGripper)
        and ask(f"{name}: open and close all the way, with nothing between the fingers?")
    ):
        scale = gripper.calibrate()
        yield Finding(
            f"its fingers reach {scale.open_count} to {scale.closed_count}: write open_count: {scale.open_count} and "
            f"closed_count: {scale.closed_count} into the lab file"
        )
        gripper.open(gripper.max_width_m)


def _camera(lab: Lab, camera: Any) -> Iterator[Finding]:
    began = time.monotonic()
    first = as_capture(camera.capture()).observation
    opened_s = time.monotonic() - began
    time.sleep(_APART_S)
    began = time.monotonic()
    second = as_capture(camera.capture()).observation
    took_s = time.monotonic() - began
    height, width = first.depth_m.shape
    speed = f"first after {opened_s:.1f} s, then {took_s:.2f} s"
    yield Finding(f"{lab.conditions.camera}: {width}x{height} pixels, {speed}")
    if first.pair is None or first.depth_m.any():
        share = float((second.depth_m > 0).mean())
        yield Finding(f"depth for {share:.0%} of all pixels", share > _LEAST_READ)
    if second.stamp_s == first.stamp_s != 0:
        yield Finding("frozen: two pictures have the same time", False)
    yield _support(lab, second)
    yield from _drift(lab, second)


def _drift(lab: Lab, seen: Any) -> Iterator[Finding]:
    """Yield whether the marker on the table is where the calibration saw it; nothing without a calibration."""
    if not is_calibrated(lab):
        return
    marker = marker_of_lab(lab)
    if marker is None:
        yield Finding("its calibration noted no marker on the table: a shift since is not noticed")
        return
    shift_m = marker_shift_m(marker, cv2.cvtColor(seen.rgb, cv2.COLOR_RGB2GRAY), seen.K, seen.T_world_camera)
    if shift_m is None:
        yield Finding("the marker on the table is not in sight: a shift is not noticed")
        return
    text = f"the marker on the table is {1e3 * shift_m:.1f} mm from where the calibration saw it"
    moved = shift_m > MOVED_M
    yield Finding(f"{text}: camera or marker has moved; calibrate again" if moved else text, not moved)


def _support(lab: Lab, seen: Any) -> Finding:
    """Return whether the table is where the camera's pose puts it."""
    if getattr(seen, "pose_estimated", False):
        remedy = "set camera.pose to what `torc lab calibrate` wrote, or to workspace"
        return Finding(f"its pose is not known: {remedy}", False)
    try:
        level = placed(seen, None)
    except InputError as error:
        return Finding(f"no table is in sight: {error}", False)
    # In the level frame the support is at height 0; where is that plane by the pose that is set?
    T = seen.T_world_camera @ np.linalg.inv(level.T_world_camera)
    x, y, _ = lab.workspace.table.center
    inside = np.linalg.inv(T) @ [x, y, lab.workspace.support_z_m, 1.0]
    off_m, tilt = float(inside[2]), float(np.arccos(np.clip(T[2, 2], -1, 1)))
    where = f"{abs(off_m) * 1e3:.0f} mm {'below' if off_m > 0 else 'above'} where the workspace has it"
    text = f"the table is {where}, and tilted by {np.rad2deg(tilt):.1f} degrees"
    return Finding(text, abs(off_m) < _MOST_OFF_M and tilt < _MOST_TILT_RAD)
