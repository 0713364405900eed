"""Build the gripper's tables by moving the MJCF's gripper through its travel."""

from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.geometry.transforms import Pose, invert
from torc.robots.gripper import GripperDescription
from torc.robots.model import Model

SAMPLES = 201
"""Openings in the tables: less than half a millimetre apart for a gripper of 85 mm."""
_OBJECTS_MASK = 1
"""contype and conaffinity of objects."""

Pieces = tuple[list[list[int]], list[int]]
"""Ids of the collision geoms of each finger (pads and blade), and of the rest of the gripper."""


def parse_gripper(model: Model) -> GripperDescription:
    """Return the gripper's description. Raises InputError if the MJCF contradicts the file."""
    gripper = model.entry.gripper
    joints, pieces = _joints(model), _pieces(model)
    first, last = model.m.jnt_range[model.id("joint", gripper.driver_joint)]
    rows = [_row(model, joints, pieces, angle) for angle in np.linspace(first, last, SAMPLES)]
    steps = np.diff([row["widths_m"] for row in rows])
    if np.all(steps < 0):
        rows.reverse()
    elif not np.all(steps > 0):
        raise InputError(
            f"{model.path}: the gripper's opening does not rise or fall all along its driver joint's range."
        )
    low, high = rows[0]["widths_m"], rows[-1]["widths_m"]
    if low > 1e-3 or high < gripper.max_width_m - 1e-4:
        raise InputError(
            f"{model.path}: gripper.max_width_m is {gripper.max_width_m}, but the driver joint's range in the MJCF "
            f"gives openings of {low:.4f} to {high:.4f} m."
        )
    pads = [model.box_corners(model.id("geom", g)) for g in gripper.fingers[1].pad_geoms]
    _, half_pad = box_in(invert(tcp_pose(model)), np.concatenate(pads))
    return GripperDescription(
        name=gripper.name,
        max_width_m=gripper.max_width_m,
        pad_width_m=float(2.0 * half_pad[1]),
        pad_height_m=float(2.0 * half_pad[2]),
        joint_names=tuple(model.m.joint(j).name for j in joints),
        **{name: np.array([row[name] for row in rows]) for name in rows[0]},
    )


def place_gripper(model: Model, angle: float) -> None:
    """Put the driver joint at `angle`, and all joints where joint equalities tie them to it; the arm stays at 0."""
    m, driver = model.m, model.entry.gripper.driver_joint
    known = {model.id("joint", driver): angle}
    ties = [e for e in range(m.neq) if m.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT and m.eq_obj2id[e] >= 0]
    for _ in ties:
        for e in ties:
            follower, leader = int(m.eq_obj1id[e]), int(m.eq_obj2id[e])
            if leader in known and follower not in known:
                x = known[leader] - m.qpos0[m.jnt_qposadr[leader]]
                y = np.polynomial.polynomial.polyval(x, m.eq_data[e, :5])
                known[follower] = float(y + m.qpos0[m.jnt_qposadr[follower]])
    for j in _joints(model):
        if j not in known:
            raise InputError(
                f"{model.path}: the gripper joint '{m.joint(j).name}' is tied to '{driver}' by no "
                "<equality><joint joint1=it joint2=driver/> of the MJCF; add one."
            )
    model.place(known)


def tcp_pose(model: Model) -> Pose:
    """Return the TCP's world pose at the model's state: origin between the tips, x across them, z as the site's."""
    T, other = (model.site_pose(f.tip_site) for f in reversed(model.entry.gripper.fingers))
    out = T.copy()
    out[:3, 3] = 0.5 * (T[:3, 3] + other[:3, 3])
    return out


def box_in(T_frame_world: Pose, corners: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "2 3"]:
    """Return centre and half size of the bounding box of world points, aligned with a frame."""
    p = corners @ T_frame_world[:3, :3].T + T_frame_world[:3, 3]
    low, high = p.min(axis=0), p.max(axis=0)
    return np.stack([0.5 * (low + high), 0.5 * (high - low)])


def _joints(model: Model) -> list[int]:
    bodies = model.subtree(model.id("body", model.entry.gripper.body))
    return [j for j in range(model.m.njnt) if model.m.jnt_bodyid[j] in bodies]


def _row(model: Model, joints: list[int], pieces: Pieces, angle: float) -> dict[str, Any]:
    """Return the tables' entries with the driver joint at `angle`."""
    gripper = model.entry.gripper
    place_gripper(model, angle)
    tips = [model.site_pose(f.tip_site) for f in gripper.fingers]
    T_world_tcp = tcp_pose(model)
    T = invert(T_world_tcp)
    actuator = model.id("actuator", gripper.actuator)
    length = float(model.d.actuator_length[actuator])
    # An affine actuator (force = gain ctrl + b0 + b1 length) rests at the command at which it exerts no force.
    gain, (b0, b1) = float(model.m.actuator_gainprm[actuator, 0]), model.m.actuator_biasprm[actuator, :2]
    if gain == 0 or b1 >= 0:
        raise InputError(f"{model.path}: the actuator '{gripper.actuator}' must be a position servo.")
    fingers = [box_in(T, np.concatenate([model.box_corners(g) for g in geoms])) for geoms in pieces[0]]
    rest = np.array([box_in(T, model.box_corners(g)) for g in pieces[1]]).reshape(-1, 2, 3)
    return {
        "widths_m": float(T_world_tcp[:3, 0] @ (tips[1][:3, 3] - tips[0][:3, 3])),
        "Ts_tool0_tcp": invert(model.site_pose(model.entry.arm.tool0_site)) @ T_world_tcp,
        "joint_qpos": model.d.qpos[[model.m.jnt_qposadr[j] for j in joints]].copy(),
        "actuator_lengths": length,
        "actuator_ctrl": float(-(b0 + b1 * length) / gain),
        "finger_boxes_table": np.array(fingers),
        "palm_boxes_table": rest,
    }


def _pieces(model: Model) -> Pieces:
    gripper = model.entry.gripper
    fingers = [[model.id("geom", g) for g in (*f.pad_geoms, *f.blade_geoms)] for f in gripper.fingers]
    for g in (g for geoms in fingers for g in geoms):
        own, others = model.m.geom_contype[g], model.m.geom_conaffinity[g]
        if not (own | others) & _OBJECTS_MASK:
            raise InputError(
                f"{model.path}: the geom '{model.m.geom(g).name}' of a finger goes through every object: it has "
                f"contype={own} and conaffinity={others} in the MJCF. Make it collide (contype=1), or name a geom that "
                "does in pad_geoms or blade_geoms."
            )
    bodies = model.subtree(model.id("body", gripper.body))
    rest = [g for b in bodies for g in model.collision_geoms(b) if not any(g in geoms for geoms in fingers)]
    return fingers, rest
