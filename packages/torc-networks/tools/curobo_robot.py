"""Write a robot for cuRobo: a URDF of the arm and a YAML file with its spheres, from torc's own description.

The base link is the world, so that poses and obstacles need no other frame. The gripper is fully open; what is held is
a link of its own.

python packages/torc-networks/tools/curobo_robot.py sda10f_2f85 curobo_robot
"""

from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
import yaml
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from torc import TorcError, load_robot
from torc.collision.collision_world import CollisionConfig
from torc.geometry.transforms import Pose, transform_points
from torc.robots.description import RobotDescription

BASE, TOOL, HELD = "world", "tool0", "attached_object"
_HELD_SPHERES = 80
_JERK_PER_ACCELERATION = 20.0
"""torc has no jerk limits: this lets a joint reach its full acceleration in a twentieth of a second."""


def write_curobo_robot(
    robot: Annotated[str, tyro.conf.Positional], folder: Annotated[Path, tyro.conf.Positional]
) -> Path:
    """Write NAME.urdf and NAME.yml of a robot; return the path of the latter.

    Args:
        robot: a name, or a robot description file.
        folder: is made.
    """
    description = load_robot(robot)
    folder.mkdir(parents=True, exist_ok=True)
    urdf, config = folder / f"{description.name}.urdf", folder / f"{description.name}.yml"
    urdf.write_text(urdf_of(description))
    facts = config_of(description, urdf, CollisionConfig())
    config.write_text(yaml.safe_dump(facts, sort_keys=False))
    return config


def urdf_of(robot: RobotDescription) -> str:
    """Return the arm as links and joints, without shapes; the last link is tool0, the flange."""
    arm = robot.arm
    lines = [f'<robot name="{robot.name}">', f'  <link name="{BASE}"/>']
    parent = BASE
    for i, joint in enumerate(arm.joint_names):
        T = arm.T_world_base @ arm.Ts_parent_joint[0] if i == 0 else arm.Ts_parent_joint[i]
        limit = f'lower="{arm.lower[i]:.9g}" upper="{arm.upper[i]:.9g}" velocity="{arm.max_speed[i]:.9g}" effort="1000"'
        lines += [
            f'  <link name="{link_name(i)}"/>',
            f'  <joint name="{joint}" type="revolute">',
            *_between(parent, link_name(i), T),
            f'    <axis xyz="{_text(arm.axes[i])}"/>',
            f"    <limit {limit}/>",
            "  </joint>",
        ]
        parent = link_name(i)
    lines += [f'  <link name="{TOOL}"/>', f'  <joint name="{TOOL}_fixed" type="fixed">']
    lines += [*_between(parent, TOOL, arm.T_last_tool0), "  </joint>", "</robot>", ""]
    return "\n".join(lines)


def link_name(i: int) -> str:
    """Name the arm's link that joint i moves."""
    return f"link_{i + 1}"


def config_of(robot: RobotDescription, urdf: Path, padding: CollisionConfig) -> dict[str, Any]:
    """Return cuRobo's description of the robot; its spheres include torc's paddings to voxels."""
    arm, names = robot.arm, [*map(link_name, range(robot.arm.dof)), TOOL]
    spheres = {name: list(_spheres_of(robot, k)) for k, name in enumerate(names)}
    spheres[BASE] = [_sphere(s[:3], s[3]) for s in robot.static_spheres]
    room = dict.fromkeys(names, padding.padding_m) | {TOOL: padding.gripper_padding_m}
    for name, own in spheres.items():
        for sphere in own:
            sphere["radius"] = round(sphere["radius"] + room.get(name, 0.0), 6)
    kinematics = {
        "urdf_path": str(urdf),
        "base_link": BASE,
        "tool_frames": [TOOL],
        "collision_link_names": [BASE, *names, HELD],
        "collision_spheres": spheres,
        # Against itself the robot has no such room.
        "self_collision_buffer": {name: -room.get(name, 0.0) for name in (BASE, *names, HELD)},
        "self_collision_ignore": _never_touching(robot, names),
        "extra_links": {
            HELD: {
                "parent_link_name": TOOL,
                "link_name": HELD,
                "joint_name": f"{HELD}_fixed",
                "joint_type": "FIXED",
                "fixed_transform": [0, 0, 0, 1, 0, 0, 0],
            }
        },
        "extra_collision_spheres": {HELD: _HELD_SPHERES},
        "lock_joints": {},
        "cspace": {
            "joint_names": list(arm.joint_names),
            "default_joint_position": arm.rest_qpos.tolist(),
            "max_acceleration": arm.max_acceleration.tolist(),
            "max_jerk": (_JERK_PER_ACCELERATION * arm.max_acceleration).tolist(),
        },
    }
    return {"kinematics": kinematics}


def _spheres_of(robot: RobotDescription, link: int) -> Iterator[dict[str, Any]]:
    """Yield the spheres of a link of the arm, in its frame; link dof is tool0, with gripper and open fingers."""
    model, dof, width = robot.spheres, robot.arm.dof, robot.gripper.max_width_m
    for center, radius in zip(model.centers[model.link == link], model.radii[model.link == link]):
        yield _sphere(center, radius)
    if link == dof:
        T_tool0_tcp = robot.gripper.T_tool0_tcp(width)
        for finger, side in ((dof + 1, -0.5), (dof + 2, 0.5)):
            own = model.link == finger
            moved = model.centers[own] + np.array([side * width, 0.0, 0.0])
            for center, radius in zip(transform_points(T_tool0_tcp, moved), model.radii[own]):
                yield _sphere(center, radius)


def _never_touching(robot: RobotDescription, names: list[str]) -> dict[str, list[str]]:
    """Return the pairs of links that are not checked: all but those that torc checks."""
    dof = robot.arm.dof
    checked = {frozenset(min(int(k), dof) for k in pair) for pair in robot.self_pairs}
    index = {name: k for k, name in enumerate(names)} | {BASE: -1, HELD: -2}
    checked |= {frozenset((-1, min(k, dof))) for k in robot.static_links}
    # What is held may touch all links of the arm but the last, and the parts that do not move.
    checked |= {frozenset((-2, k)) for k in range(-1, dof - 1)}
    out: dict[str, list[str]] = {}
    for a, b in combinations(index, 2):
        if frozenset((index[a], index[b])) not in checked:
            out.setdefault(a, []).append(b)
    return out


def _between(parent: str, child: str, T: Pose) -> list[str]:
    rpy = Rotation.from_matrix(T[:3, :3]).as_euler("xyz")
    return [
        f'    <parent link="{parent}"/>',
        f'    <child link="{child}"/>',
        f'    <origin xyz="{_text(T[:3, 3])}" rpy="{_text(rpy)}"/>',
    ]


def _sphere(center: Float[np.ndarray, "3"], radius: float) -> dict[str, Any]:
    return {"center": [round(float(c), 6) for c in center], "radius": float(radius)}


def _text(numbers: np.ndarray) -> str:
    return " ".join(f"{n:.12g}" for n in numbers)


if __name__ == "__main__":
    try:
        print(tyro.cli(write_curobo_robot))
    except TorcError as error:
        raise SystemExit(f"error: {error}") from None
