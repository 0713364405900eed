"""What the arm did and what its camera saw, 25 times a simulated second: for imitation learning."""

import zipfile
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from types import TracebackType

import numpy as np
from jaxtyping import Float32, Float64, Int16

from torc.episode.events import Event, Looked, Started
from torc.episode.mp4 import Mp4Writer
from torc.errors import InputError
from torc.records.serialization import load_record, save_record
from torc.robots.description import RobotDescription
from torc.sim.rendering import CameraRenderer
from torc.sim.world import World
from torc.workspace.description import CameraMount

FPS = 25
"""Frames per simulated second: how often the simulation calls its observers."""
WIDTH, HEIGHT = 320, 240
TRAJECTORY, CAMERA = "trajectory.npz", "camera.mp4"
MAX_FRAMES = 100_000
_MAX_UNPACKED_BYTES = 256 * 2**20
_ENCODER = {"crf": "20", "g": "5"}
"""A key frame every 0.2 s: training reads frames in any order."""


@dataclass(frozen=True)
class RecordedMotion:
    """A trial as its robot went through it, a row per frame of the camera's video.

    Attributes:
        robot: name of the robot.
        joint_names: of the arm, from base to flange.
        fps: frames per second.
        pick: number of the pick, from 0.
        times_s: simulated time.
        qpos: joint positions, radians.
        commanded_qpos: what the joints' servos were told, radians.
        width_m: opening of the gripper.
        commanded_width_m: what the gripper was told; 0 to close.
    """

    robot: str
    joint_names: tuple[str, ...]
    fps: int
    pick: Int16[np.ndarray, "n"]
    times_s: Float64[np.ndarray, "n"]
    qpos: Float32[np.ndarray, "n dof"]
    commanded_qpos: Float32[np.ndarray, "n dof"]
    width_m: Float32[np.ndarray, "n"]
    commanded_width_m: Float32[np.ndarray, "n"]

    def __len__(self) -> int:
        return len(self.pick)


class TrajectoryRecorder:
    """Writes trajectory.npz and camera.mp4 into a trial's directory. Use it in a `with`.

    It is an observer of the simulation and a listener of the episode, and changes nothing in either. The frames begin
    with the first look. While the robot looks, decides and plans, no simulated time passes.
    """

    def __init__(self, directory: Path) -> None:
        self._directory = directory
        self._video = Mp4Writer(directory / CAMERA, WIDTH, HEIGHT, Fraction(FPS), _ENCODER)
        self._renderer: CameraRenderer | None = None
        self._robot: RobotDescription | None = None
        self._pick: int | None = None
        self._rows: list[tuple[int, float, np.ndarray, np.ndarray, float, float]] = []

    def __enter__(self) -> "TrajectoryRecorder":
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._video.close()
        if self._renderer is not None:
            self._renderer.close()
        if self._robot is not None and self._rows:
            save_record(self._motion(self._robot), self._directory / TRAJECTORY)

    def __call__(self, event: Event) -> None:
        """Follows which pick it is."""
        match event:
            case Started():
                self._pick = None
            case Looked():
                self._pick = event.pick
            case _:
                pass

    def observe(self, world: World) -> None:
        """Called by the simulation FPS times a simulated second."""
        if self._pick is None or world.robot is None:
            return
        if self._renderer is None:
            camera = world.workspace.camera
            mount = CameraMount(camera.T_world_camera, WIDTH, HEIGHT, camera.vertical_fov_rad)
            self._renderer, self._robot = CameraRenderer(world, mount), world.robot
        self._video.write(self._renderer.render_color())
        self._rows.append((self._pick, world.time_s, *_arm(world, world.robot), *_grip(world, world.robot)))

    def _motion(self, robot: RobotDescription) -> RecordedMotion:
        pick, times_s, qpos, commanded, width_m, commanded_width_m = zip(*self._rows)
        return RecordedMotion(
            robot=robot.name,
            joint_names=robot.arm.joint_names,
            fps=FPS,
            pick=np.array(pick, np.int16),
            times_s=np.array(times_s),
            qpos=np.array(qpos, np.float32),
            commanded_qpos=np.array(commanded, np.float32),
            width_m=np.array(width_m, np.float32),
            commanded_width_m=np.array(commanded_width_m, np.float32),
        )


def load_motion(path: Path) -> RecordedMotion:
    """What TrajectoryRecorder wrote, checked: it may come from a stranger.

    Raises:
        InputError: missing, damaged, too large, or with arrays that do not fit each other.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
    except (OSError, zipfile.BadZipFile) as error:
        raise InputError(f"'{path}' is not a readable trajectory: {error}") from error
    if size > _MAX_UNPACKED_BYTES:
        raise InputError(f"'{path}' is larger than {_MAX_UNPACKED_BYTES // 2**20} MB unpacked.")
    found = load_record(path, RecordedMotion)
    n, dof = len(found.pick), len(found.joint_names)
    rows = (found.times_s, found.qpos, found.commanded_qpos, found.width_m, found.commanded_width_m)
    shapes = [(n,), (n, dof), (n, dof), (n,), (n,)]
    fits = all(isinstance(a, np.ndarray) and a.dtype.kind == "f" for a in rows)
    if not (
        fits
        and [a.shape for a in rows] == shapes
        and all(bool(np.isfinite(a).all()) for a in rows)
        and 0 < n <= MAX_FRAMES
        and found.fps == FPS
    ):
        raise InputError(f"'{path}' holds no trajectory of a trial: its arrays are not as torc writes them.")
    return found


def _arm(world: World, robot: RobotDescription) -> tuple[np.ndarray, np.ndarray]:
    """Positions and commands of the arm's joints."""
    qpos = [world.data.joint(name).qpos[0] for name in robot.arm.joint_names]
    ctrl = [world.data.actuator(name).ctrl[0] for name in robot.arm_actuator_names]
    return np.array(qpos), np.array(ctrl)


def _grip(world: World, robot: RobotDescription) -> tuple[float, float]:
    """Opening of the gripper, and the one that it was told; both by the gripper's table."""
    gripper = robot.gripper
    position = float(world.data.joint(gripper.joint_names[0]).qpos[0])
    ctrl = float(world.data.actuator(robot.gripper_actuator_name).ctrl[0])
    return (
        _width(position, gripper.joint_qpos[:, 0], gripper.widths_m),
        _width(ctrl, gripper.actuator_ctrl, gripper.widths_m),
    )


def _width(value: float, table: np.ndarray, widths_m: np.ndarray) -> float:
    """The width at which a monotonic column of the table has that value; the nearest end outside."""
    order = np.argsort(table)
    return float(np.interp(value, table[order], widths_m[order]))
