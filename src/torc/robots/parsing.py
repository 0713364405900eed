"""Turn a robot file and its MJCF into a RobotDescription.

Kinematics, limits and shapes come from the compiled MJCF, so that the simulator and the planners can never disagree
about the robot.
"""

import hashlib
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from torc.errors import InputError
from torc.geometry.transforms import invert
from torc.io.digests import fingerprint
from torc.robots.description import ArmDescription, RobotDescription
from torc.robots.gripper_parsing import parse_gripper
from torc.robots.model import Model
from torc.robots.proving import refuse_urdf, robot_faults
from torc.robots.schema import RobotFile, read_robot_file
from torc.robots.spheres import parse_spheres, static_spheres

_LOG = logging.getLogger("torc.mujoco")
_NONE_HERE = ("Attaching a spec with an empty prefix", "Attach conflict when attaching")
"""Beginnings of harmless warnings: a robot's parts keep their names, as no world is saved as XML; and a robot file's
options are not the world's.
"""


@contextmanager
def warnings_in_the_log() -> Iterator[None]:
    """Send warnings to Python's log, not to MuJoCo's file, in the block and in later steps of the simulation."""
    mujoco.set_mju_user_warning(_warn)
    with warnings.catch_warnings():
        for text in _NONE_HERE:
            warnings.filterwarnings("ignore", text)
        yield


def _warn(text: str) -> None:
    if not text.startswith(_NONE_HERE):
        _LOG.warning(text)


_WHERE = ("paths", "npaths", "nbuffer")
"""Fields of a compiled model that depend on where its mesh and texture files lie."""


def parse_robot(path: Path) -> RobotDescription:
    """Read a robot file. Raises InputError that names the file and the fault."""
    robot, faults = try_robot(path)
    if listed := "".join(f"\n- {fault}." for of_part in faults.values() for fault in of_part):
        raise InputError(f"The robot of {path} cannot pick:{listed}")
    return robot


def try_robot(path: Path) -> tuple[RobotDescription, dict[str, list[str]]]:
    """Read a robot file and try the robot; return it and what would keep it from picking, by part, empty if nothing.

    Raises InputError if the files cannot be read, or contradict the format or each other.
    """
    entry = read_robot_file(path)
    mjcf_path = (path.parent / entry.mjcf).resolve()
    compiled = compile_mjcf(mjcf_path)
    source = _source(entry, compiled)  # before it is posed for reading
    model, m = Model(path, entry, compiled), compiled
    for name in entry.arm.actuators:
        model.id("actuator", name)
    arm, gripper, links = _parse_arm(model), parse_gripper(model), _links(model)
    spheres = parse_spheres(model, arm, gripper, links)
    self_pairs, static_links = _checked_links(model, links, arm.dof)
    fingers = entry.gripper.fingers
    robot = RobotDescription(
        name=entry.name,
        arm=arm,
        gripper=gripper,
        spheres=spheres,
        static_spheres=static_spheres(model, links),
        self_pairs=self_pairs,
        static_links=static_links,
        mjcf_path=mjcf_path,
        arm_actuator_names=tuple(entry.arm.actuators),
        gripper_actuator_name=entry.gripper.actuator,
        gripper_body_name=entry.gripper.body,
        finger_body_names=(fingers[0].body, fingers[1].body),
        pad_geom_names=(tuple(fingers[0].pad_geoms), tuple(fingers[1].pad_geoms)),
        tip_site_names=(fingers[0].tip_site, fingers[1].tip_site),
        tool0_site_name=entry.arm.tool0_site,
        root_body_names=tuple(m.body(b).name for b in range(1, m.nbody) if m.body_parentid[b] == 0),
        source=source,
    )
    return robot, robot_faults(robot, m)


def compile_mjcf(mjcf_path: Path) -> Any:
    """Compile an MJCF. Raises InputError if the file is missing, a URDF, or not accepted by MuJoCo."""
    if not mjcf_path.is_file():
        raise InputError(f"There is no MJCF file {mjcf_path}; the robot file's `mjcf` is relative to itself.")
    refuse_urdf(mjcf_path)
    try:
        with warnings_in_the_log():
            return mujoco.MjModel.from_xml_path(str(mjcf_path))
    except ValueError as error:
        raise InputError(f"MuJoCo cannot compile {mjcf_path}: {error}") from error


def _parse_arm(model: Model) -> ArmDescription:
    m, entry = model.m, model.entry.arm
    ids = [model.id("joint", name) for name in entry.joints]
    _check_chain(model, ids)
    model.place({})
    Ts = np.array([model.joint_pose(j) for j in ids])
    base = model.body_pose(int(m.body_parentid[m.jnt_bodyid[ids[0]]]))
    tool0 = model.site_pose(entry.tool0_site)
    before = np.concatenate([base[None], Ts[:-1]])
    speed = np.minimum(entry.speed_deg_s, entry.hardware_speed_deg_s)
    lower, upper = m.jnt_range[ids, 0].copy(), m.jnt_range[ids, 1].copy()
    rest = np.array(entry.rest_qpos_rad, dtype=float)
    if np.any((rest < lower) | (rest > upper)):
        raise InputError(f"{model.path}: arm.rest_qpos_rad is outside the joint limits of the MJCF.")
    return ArmDescription(
        joint_names=tuple(entry.joints),
        Ts_parent_joint=invert(before) @ Ts,
        axes=m.jnt_axis[ids].copy(),
        T_world_base=base,
        T_last_tool0=invert(Ts[-1]) @ tool0,
        lower=lower,
        upper=upper,
        max_speed=np.deg2rad(speed),
        max_acceleration=np.full(len(ids), np.deg2rad(entry.acceleration_deg_s2)),
        rest_qpos=rest,
    )


def _check_chain(model: Model, ids: list[int]) -> None:
    m, above = model.m, 0
    for name, j in zip(model.entry.arm.joints, ids):
        if m.jnt_type[j] != mujoco.mjtJoint.mjJNT_HINGE or not m.jnt_limited[j]:
            raise InputError(f"{model.path}: arm joint '{name}' must be a hinge with a range in the MJCF.")
        body = int(m.jnt_bodyid[j])
        between = model.ancestors(body, stop=above)
        if any(m.body_jntnum[b] for b in between[1:]) or m.body_jntnum[body] != 1:
            raise InputError(
                f"{model.path}: the MJCF has a joint between '{name}' and the arm joint before it."
            )
        if above and above not in model.ancestors(body):
            raise InputError(f"{model.path}: arm joint '{name}' is not further out than the one before it.")
        above = body


def _links(model: Model) -> np.ndarray:
    """Return, per body, the link number of SphereModel; -1 static, -2 gripper parts except its body and fingers."""
    m, entry, dof = model.m, model.entry, len(model.entry.arm.joints)
    own = {int(m.jnt_bodyid[model.id("joint", n)]): i for i, n in enumerate(entry.arm.joints)}
    own[model.id("body", entry.gripper.body)] = dof
    own |= {model.id("body", f.body): dof + 1 + i for i, f in enumerate(entry.gripper.fingers)}
    links = np.full(m.nbody, -1)
    for body in range(1, m.nbody):
        inherited = links[m.body_parentid[body]]
        if m.body_jntnum[body] and body not in own:
            if inherited not in (dof, -2):
                raise InputError(
                    f"{model.path}: body '{m.body(body).name}' moves, but belongs neither to the arm nor to the "
                    "gripper. Remove its joint from the MJCF."
                )
            inherited = -2
        links[body] = own.get(body, inherited)
    return links


def _checked_links(model: Model, links: np.ndarray, dof: int) -> tuple[np.ndarray, tuple[int, ...]]:
    """Return pairs of links that can touch each other, and links that can touch the fixed parts.

    By default the pairs are all links at least two joints apart, the whole gripper being one with its flange.
    """

    def link_of(body_name: str) -> int:
        link = int(links[model.id("body", body_name)])
        if link < 0:
            raise InputError(
                f"{model.path}: self_collision names '{body_name}', which is no link that moves."
            )
        return link

    named = model.entry.self_collision
    pairs = [(i, j) for i, j in combinations(range(dof + 3), 2) if min(j, dof) - i >= 2 and i < dof - 1]
    if named.pairs is not None:
        pairs = [(min(p), max(p)) for p in ([link_of(a), link_of(b)] for a, b in named.pairs)]
    never = {link_of(n) for n in named.never_with_static}
    static = tuple(i for i in range(dof + 3) if i not in never)
    return np.array(pairs, dtype=np.int64).reshape(-1, 2), static


def _source(description: RobotFile, model: Any) -> str:
    """Return the fingerprint of a robot file and of everything in its MjModel: included files, meshes, textures.

    Comments and file names do not count.
    """
    digest = hashlib.sha256()
    _take(digest, "", model)
    plain = description.model_dump(mode="json", exclude={"mjcf"})
    return fingerprint({"description": plain, "model": digest.hexdigest()})


def _take(digest: Any, name: str, value: Any) -> None:
    """Digest a number, an array, bytes, or a part of a model with everything in it."""
    if isinstance(value, (bytes, int, float, np.ndarray)):
        content = value if isinstance(value, bytes) else np.ascontiguousarray(value).tobytes()
        digest.update(f"{name}:{len(content)}:".encode() + content)
    elif not callable(value):
        for inner in sorted(vars(type(value))):
            if not inner.startswith("_") and inner not in _WHERE and not inner.endswith("_pathadr"):
                _take(digest, f"{name}.{inner}", getattr(value, inner))
