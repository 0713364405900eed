"""The simulated world: a MuJoCo model and its state, with the objects' ids.

A state is saved and restored bit for bit. `SimulatedRobot.save` covers what a robot in the world remembers besides.
"""

from collections.abc import Callable
from enum import IntEnum

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int, Int16, UInt8

from torc.errors import InputError
from torc.objects.library import load_object
from torc.objects.models import ObjectModel
from torc.problems.problem import Problem
from torc.records import BACKGROUND, MAX_OBJECTS, ROBOT, TARGET_ID
from torc.robots.description import RobotDescription
from torc.robots.parsing import warnings_in_the_log
from torc.sim.spec import WorldConfig, build_spec, object_body_name
from torc.workspace.description import Box, Workspace

_PARKING_M = np.array([-60.0, -60.0, 40.0])
_PARKING_STEP_M = 2.0
_PARTS = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_WARNINGS = int(mujoco.mjtWarning.mjNWARNING)
_OVERHANG_M = 0.03
_AWAKE = -1 - mujoco.mjMINAWAKE
"""Value of `tree_asleep`: awake, and as many steps of rest away from sleep as possible."""
_BELOW_M = 0.05


class Presence(IntEnum):
    """Where an object is, for the task. All except those in the scene are parked far away."""

    PRESENT = 0
    DELIVERED = 1
    """Put into the bin by the robot."""
    DROPPED = 2
    """Left the table otherwise."""
    ABSENT = 3
    """Not on the table when the robot began, so not a drop."""


class World:
    """A compiled world and its present state.

    Attributes:
        robot: None in a world for settling.
        robot_dofs: velocity indices of the robot's joints.
        geom_labels: per geom its object id, BACKGROUND or ROBOT.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        problem: Problem,
        models: tuple[ObjectModel, ...],
        robot: RobotDescription | None,
        workspace: Workspace,
        extra: tuple[Box, ...] = (),
    ) -> None:
        self.model, self.data = model, mujoco.MjData(model)
        self.problem, self.models, self.robot, self.workspace = problem, models, robot, workspace
        names = [object_body_name(i) for i in range(len(problem.ordered()))]
        self.object_bodies: Int[np.ndarray, n] = np.array([model.body(n).id for n in names], dtype=np.int64)
        joints = model.body_jntadr[self.object_bodies]
        self._qpos_at = model.jnt_qposadr[joints][:, None] + np.arange(7)
        self._qvel_at = model.jnt_dofadr[joints][:, None] + np.arange(6)
        robot_dofs = np.ones(model.nv, dtype=bool)
        robot_dofs[self._qvel_at.ravel()] = False
        self.robot_dofs: Int[np.ndarray, d] = np.flatnonzero(robot_dofs)
        boxes = (*workspace.static_boxes(), *extra)
        self.geom_labels: Int16[np.ndarray, g] = _label_geoms(model, boxes, self.object_bodies)
        self.presence: UInt8[np.ndarray, n] = np.zeros(len(names), np.uint8)
        if robot is not None:
            _rest_robot(model, self.data, robot)
        if problem.absent:
            self.park(TARGET_ID, Presence.ABSENT)
        self.update_position_stage()

    @property
    def object_count(self) -> int:
        return len(self.object_bodies)

    @property
    def time_s(self) -> float:
        return float(self.data.time)

    @property
    def present(self) -> Bool[np.ndarray, "n"]:
        return self.presence == Presence.PRESENT

    @property
    def positions(self) -> Float[np.ndarray, "n 3"]:
        """Positions of the objects' frames, world."""
        return self.data.qpos[self._qpos_at[:, :3]]

    @property
    def wxyz(self) -> Float[np.ndarray, "n 4"]:
        """Orientations of the objects' frames, world."""
        return self.data.qpos[self._qpos_at[:, 3:]]

    @property
    def velocities(self) -> Float[np.ndarray, "n 6"]:
        """Linear (world) and angular (object frame), m/s and rad/s."""
        return self.data.qvel[self._qvel_at]

    def speeds(self, radius_m: float = 0.05) -> Float[np.ndarray, "n"]:
        """Return linear speed + radius x angular speed per object, m/s; 0 for objects that left the scene."""
        v = self.velocities
        speed = np.linalg.norm(v[:, :3], axis=1) + radius_m * np.linalg.norm(v[:, 3:], axis=1)
        return np.where(self.present, speed, 0.0)

    def set_object_pose(self, object_id: int, position: np.ndarray, wxyz: np.ndarray) -> None:
        """Move an object to a pose, at rest; the quaternion is normalized.

        Call `update_kinematics` before reading body poses.
        """
        self.data.qpos[self._qpos_at[object_id]] = np.concatenate([position, wxyz / np.linalg.norm(wxyz)])
        self.data.qvel[self._qvel_at[object_id]] = 0.0
        self.wake()

    def wake(self) -> None:
        """End the sleep of all objects: they may have lost their support."""
        _put_to_sleep(self.model, self.data, np.full(self.model.ntree, _AWAKE))

    def on_table(self) -> tuple[int, ...]:
        """Return ids of the objects still on the table, rising: centre above it, or up to 3 cm beyond."""
        board, p = self.workspace.table, self.positions
        inside = np.abs(p[:, :2] - board.center[:2]) <= 0.5 * np.array(board.size[:2]) + _OVERHANG_M
        above = p[:, 2] > self.workspace.support_z_m - _BELOW_M
        return tuple(np.flatnonzero(inside.all(axis=1) & above & self.present).tolist())

    def off_table(self) -> tuple[int, ...]:
        """Return ids of the objects in the scene that left the table, rising."""
        return tuple(np.setdiff1d(np.flatnonzero(self.present), self.on_table()).tolist())

    def in_bin(self) -> tuple[int, ...]:
        """Return ids of the objects in the scene whose centre is within the bin, up to 5 cm above its rim."""
        bin_, p = self.workspace.bin, self.positions
        inside = np.abs(p[:, :2] - bin_.center[:2]) <= 0.5 * np.array(bin_.inner_size[:2])
        height = p[:, 2] - bin_.center[2]
        within = (height > -bin_.wall_m) & (height < bin_.inner_size[2] + _BELOW_M)
        return tuple(np.flatnonzero(inside.all(axis=1) & within & self.present).tolist())

    def park(self, object_id: int, presence: Presence) -> None:
        """Take an object out of the scene: far away, touching nothing, its weight cancelled by a force.

        The force is part of the saved state; gravity is not.
        """
        spot = _PARKING_M - np.array([0.0, _PARKING_STEP_M * object_id, 0.0])
        self.set_object_pose(object_id, spot, np.array([1.0, 0, 0, 0]))
        body = self.object_bodies[object_id]
        self.data.xfrc_applied[body, :3] = -self.model.body_mass[body] * self.model.opt.gravity
        self.presence[object_id] = presence

    def unpark(self, object_id: int, position: np.ndarray, wxyz: np.ndarray) -> None:
        self.set_object_pose(object_id, position, wxyz)
        self.data.xfrc_applied[self.object_bodies[object_id]] = 0.0
        self.presence[object_id] = Presence.PRESENT

    def body_name_of_geom(self, geom: int) -> str:
        """Return, for messages, the name of what a geom belongs to: an object's own name, a robot body, "table" ..."""
        label = int(self.geom_labels[geom])
        if label >= 0:
            return f"object {label} ({self.problem.ordered()[label].name})"
        if label == BACKGROUND:
            return str(self.model.geom(geom).name)
        return str(self.model.body(self.model.geom_bodyid[geom]).name)

    def update_kinematics(self) -> None:
        """Update body poses from the joint positions; the physics is not touched."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def update_position_stage(self) -> None:
        """Update everything that depends on positions alone, including contacts.

        Not mj_forward, which would replace the solver's warm start and change the future in its last bits.
        """
        mujoco.mj_fwdPosition(self.model, self.data)


def build_world(
    problem: Problem,
    robot: RobotDescription | None,
    workspace: Workspace,
    config: WorldConfig | None = None,
    extra: tuple[Box, ...] = (),
    load_model: Callable[[str], ObjectModel] = load_object,
) -> World:
    """Build the world of a problem at its first state: objects where the problem puts them, the arm at rest.

    Without a robot it is faster, for settling. `extra` are further fixed boxes; `load_model` returns a name's model.
    Raises InputError for too many objects, a problem of another workspace, or a model that MuJoCo does not accept.
    """
    if (n := len(problem.ordered())) > MAX_OBJECTS:
        raise InputError(f"{problem.name}: {n} objects; at most {MAX_OBJECTS} are possible.")
    if problem.workspace not in ("", workspace.name):
        raise InputError(
            f"{problem.name} is made for the workspace '{problem.workspace}', not for '{workspace.name}': give it with "
            "--workspace, or leave --workspace out."
        )
    models = tuple(load_model(placement.model) for placement in problem.ordered())
    try:
        with warnings_in_the_log():
            spec = build_spec(problem, models, robot, workspace, config or WorldConfig(), extra)
            model = spec.compile()
    except ValueError as error:
        raise InputError(f"{problem.name}: MuJoCo does not accept the world: {error}") from error
    return World(model, problem, models, robot, workspace, extra)


def _rest_robot(model: mujoco.MjModel, data: mujoco.MjData, robot: RobotDescription) -> None:
    """Put the arm at rest and open the gripper, with the servos commanded to stay there."""
    arm, gripper = robot.arm, robot.gripper
    for name, actuator, q in zip(arm.joint_names, robot.arm_actuator_names, arm.rest_qpos):
        data.joint(name).qpos[:] = q
        data.actuator(actuator).ctrl[:] = q
    for name, q in zip(gripper.joint_names, gripper.qpos(gripper.max_width_m)):
        data.joint(name).qpos[:] = q
    data.actuator(robot.gripper_actuator_name).ctrl[:] = gripper.ctrl(gripper.max_width_m)


def _label_geoms(
    model: mujoco.MjModel, boxes: tuple[Box, ...], object_bodies: Int[np.ndarray, "n"]
) -> Int16[np.ndarray, "g"]:
    background = {"floor", "bin_stand", *(b.name for b in boxes)}
    names = [model.geom(geom).name for geom in range(model.ngeom)]
    is_background = [name in background or name.startswith(("leg_", "room_")) for name in names]
    labels = np.where(is_background, BACKGROUND, ROBOT).astype(np.int16)
    for object_id, body in enumerate(object_bodies):
        labels[model.geom_bodyid == body] = object_id
    return labels


def save_state(world: World) -> Float[np.ndarray, "s"]:
    """Return everything that decides the world's future, as one array: MuJoCo's integration state, each object's
    Presence, MuJoCo's counts of warnings, by which the watchdog detects a diverged simulation, and what sleeps.
    """
    state = np.empty(mujoco.mj_stateSize(world.model, _PARTS))
    mujoco.mj_getState(world.model, world.data, state, _PARTS)
    warnings = [float(warning.number) for warning in world.data.warning]
    asleep = world.data.tree_asleep.astype(float)
    return np.concatenate([state, world.presence.astype(float), warnings, asleep])


def refresh(world: World) -> None:
    """Forget how the world got into its state, so that it continues as a restored copy would.

    If objects may sleep, MuJoCo remembers more of that.
    """
    restore_state(world, save_state(world))


def restore_state(world: World, state: Float[np.ndarray, "s"]) -> None:
    """Restore a state saved from this world, or from one built alike, maybe in another process.

    Raises InputError for a state of another size.
    """
    size = mujoco.mj_stateSize(world.model, _PARTS)
    ends = np.cumsum([size, world.object_count, _WARNINGS, world.model.ntree])
    if state.shape != (ends[-1],):
        raise InputError(
            f"The state has {state.shape} numbers, this world needs {ends[-1]}: "
            "it was saved from a world with other objects or another robot."
        )
    mujoco.mj_resetData(world.model, world.data)
    mujoco.mj_setState(world.model, world.data, np.ascontiguousarray(state[:size]), _PARTS)
    world.presence[:] = state[size : ends[1]].astype(np.uint8)
    for warning, number in zip(world.data.warning, state[ends[1] : ends[2]], strict=True):
        warning.number = int(number)
    # Nothing is computed for sleeping bodies: their poses have to be up to date before.
    world.wake()
    world.update_position_stage()
    _put_to_sleep(world.model, world.data, state[ends[2] :].astype(int))
    world.update_position_stage()


def _put_to_sleep(model: mujoco.MjModel, data: mujoco.MjData, tree_asleep: Int[np.ndarray, "t"]) -> None:
    """Set what sleeps and what is awake, as `data.tree_asleep` was read from a world built alike.

    Positions must be up to date. Derived values are set as `mj_updateSleep` does.
    """
    data.tree_asleep[:] = tree_asleep
    tree_awake = data.tree_asleep < 0
    data.tree_awake[:], data.ntree_awake = tree_awake, int(tree_awake.sum())
    moving = model.body_treeid >= 0
    yes, no = int(mujoco.mjtSleepState.mjS_AWAKE), int(mujoco.mjtSleepState.mjS_ASLEEP)
    data.body_awake[moving] = np.where(tree_awake[model.body_treeid[moving]], yes, no)
    computed = data.body_awake != no
    data.nbody_awake = _list(data.body_awake_ind, np.flatnonzero(computed))
    parents = 1 + np.flatnonzero(computed[model.body_parentid[1:]])
    data.nparent_awake = _list(data.parent_awake_ind, parents)
    awake = moving & (data.body_awake == yes)
    data.nv_awake = _list(data.dof_awake_ind, np.flatnonzero(awake[model.dof_bodyid]))


def _list(into: Int[np.ndarray, "n"], indices: Int[np.ndarray, "k"]) -> int:
    into[: len(indices)] = indices
    return len(indices)
