"""The world of a grasp trial: table, objects, and the gripper on a force-limited carrier in place of the arm."""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from torc.errors import InputError
from torc.objects.library import load_object
from torc.objects.models import ObjectModel
from torc.problems.problem import Problem
from torc.robots.description import RobotDescription
from torc.robots.gripper import GripperDescription
from torc.sim.spec import COLLISION_GROUP, WorldConfig, build_spec, object_body_name
from torc.workspace.description import Workspace

_PREFIX = "hand_"
_FAR_AWAY = (-3.0, 0.0, 3.0)
_CARRIER_MASS_KG, _CARRIER_INERTIA = 0.5, 2e-3


@dataclass(frozen=True)
class CarrierConfig:
    """The carrier, and how long the objects come to rest in its world.

    Attributes:
        force_n: largest force of each slide.
        torque_nm: largest torque of each hinge.
        stiffness: newtons per metre; damping is critical.
        angular_stiffness: newton metres per radian.
        rest_s: time simulated before the state that all trials start from.
    """

    force_n: float = 60.0
    torque_nm: float = 8.0
    stiffness: float = 20000.0
    angular_stiffness: float = 400.0
    rest_s: float = 0.6


@dataclass(frozen=True)
class FloatingModel:
    """A compiled trial world and its settled state.

    Attributes:
        model: MuJoCo's.
        settled: the state that all trials start from: objects at rest and asleep, gripper far away.
        gripper: its description.
        object_bodies: body of each object id.
        linear_dofs: velocity addresses of the objects' translations.
        carrier_qpos, carrier_dofs, carrier_motors: addresses of the three slides and three hinges.
        gripper_motor: actuator of the gripper; command 0 = open.
        closed_command: command that closes it.
        max_force: most that it can exert.
        is_hand_geom, is_left_finger_geom, is_right_finger_geom: per geom.
        support_z_m: height of the table.
        drop_position: of the TCP over the bin.
    """

    model: mujoco.MjModel
    settled: mujoco.MjData
    gripper: GripperDescription
    object_bodies: Int[np.ndarray, "n"]
    linear_dofs: Int[np.ndarray, "n3"]
    carrier_qpos: Int[np.ndarray, "6"]
    carrier_dofs: Int[np.ndarray, "6"]
    carrier_motors: Int[np.ndarray, "6"]
    gripper_motor: int
    closed_command: float
    max_force: float
    is_hand_geom: Bool[np.ndarray, "g"]
    is_left_finger_geom: Bool[np.ndarray, "g"]
    is_right_finger_geom: Bool[np.ndarray, "g"]
    support_z_m: float
    drop_position: Float[np.ndarray, "3"]


def build_floating(
    problem: Problem,
    robot: RobotDescription,
    workspace: Workspace,
    carrier: CarrierConfig | None = None,
    load_model: Callable[[str], ObjectModel] = load_object,
) -> FloatingModel:
    """The trial world of a problem whose objects are at rest where it puts them.

    Sleeping is on: objects that nothing touches cost nothing, which makes a trial several times faster.

    Raises:
        InputError: MuJoCo does not accept the world.
    """
    config = CarrierConfig() if carrier is None else carrier
    models = tuple(load_model(placement.model) for placement in problem.ordered())
    spec = build_spec(problem, models, None, workspace, WorldConfig())
    spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP
    _strip_visuals(spec)
    _add_carrier(spec, robot, config)
    try:
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"{problem.name}: MuJoCo does not accept the trial world: {error}") from error
    return _index(model, problem, robot, workspace, config)


def _strip_visuals(spec: mujoco.MjSpec) -> None:
    """Delete what is only looked at: it takes long to compile."""
    for geom in [
        g for g in spec.geoms if g.contype == 0 and g.conaffinity == 0 and g.group != COLLISION_GROUP
    ]:
        spec.delete(geom)


def _add_carrier(spec: mujoco.MjSpec, robot: RobotDescription, config: CarrierConfig) -> None:
    source = mujoco.MjSpec.from_file(str(robot.mjcf_path))
    base = source.body(robot.gripper_body_name)
    root = spec.worldbody.add_body(name="carrier_frame", mocap=True, pos=list(_FAR_AWAY))
    carrier = root.add_body(
        name="carrier", gravcomp=1.0, mass=_CARRIER_MASS_KG, inertia=[_CARRIER_INERTIA] * 3
    )
    carrier.explicitinertial = True
    for k in range(6):
        slide = k < 3
        kind = mujoco.mjtJoint.mjJNT_SLIDE if slide else mujoco.mjtJoint.mjJNT_HINGE
        name = f"carrier_{k}"
        carrier.add_joint(name=name, type=kind, axis=np.eye(3)[k % 3], armature=0.5 if slide else 0.01)
        limit = config.force_n if slide else config.torque_nm
        motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.set_to_position(kp=config.stiffness if slide else config.angular_stiffness, dampratio=1.0)
        motor.forcerange, motor.forcelimited = [-limit, limit], True
    base.pos, base.quat = [0, 0, 0], [1, 0, 0, 0]
    carrier.add_frame().attach_body(base, _PREFIX, "")


def _index(
    model: mujoco.MjModel,
    problem: Problem,
    robot: RobotDescription,
    workspace: Workspace,
    config: CarrierConfig,
) -> FloatingModel:
    objects = np.array(
        [model.body(object_body_name(i)).id for i in range(len(problem.ordered()))], dtype=np.int64
    )
    joints = np.array([model.joint(f"carrier_{k}").id for k in range(6)])
    motor = model.actuator(_PREFIX + robot.gripper_actuator_name).id
    names = [model.body(int(b)).name for b in model.geom_bodyid]
    left, right = (_PREFIX + name for name in robot.finger_body_names)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, round(config.rest_s / model.opt.timestep))
    data.time = 0.0
    return FloatingModel(
        model=model,
        settled=data,
        gripper=robot.gripper,
        object_bodies=objects,
        linear_dofs=(model.body_dofadr[objects][:, None] + np.arange(3)).ravel(),
        carrier_qpos=model.jnt_qposadr[joints].astype(np.int64),
        carrier_dofs=model.jnt_dofadr[joints].astype(np.int64),
        carrier_motors=np.array([model.actuator(f"carrier_{k}").id for k in range(6)], dtype=np.int64),
        gripper_motor=int(motor),
        closed_command=float(model.actuator_ctrlrange[motor, 1]),
        max_force=float(model.actuator_forcerange[motor, 1]),
        is_hand_geom=np.array([n.startswith(_PREFIX) for n in names]),
        is_left_finger_geom=np.array([n == left for n in names]),
        is_right_finger_geom=np.array([n == right for n in names]),
        support_z_m=workspace.support_z_m,
        drop_position=np.array(workspace.drop_position),
    )
