"""Record what the arm did and what its camera saw, 25 times a simulated second: for imitation learning."""

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64, Int16

from torc.episode.events import Event, Looked
from torc.errors import InputError
from torc.io.record_files import load_checked, save_record
from torc.robots.description import RobotDescription
from torc.sim.rendering import CameraRenderer, Closing
from torc.sim.simulated_world import World
from torc.trials.video import Mp4Writer
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
        pick: number of the pick, from 0.
        times_s: simulated time.
        qpos, commanded_qpos: actual and commanded angles of the arm's joints, radians, from base to flange.
        width_m, commanded_width_m: actual and commanded opening of the gripper (0 to close).
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


class TrajectoryRecorder(Closing):
    """Writes trajectory.npz and camera.mp4 into a trial's directory. Use it in a `with`.

    It observes the simulation and listens to the episode, and changes nothing in either. The frames begin with the
    first look. While the robot looks, decides and plans, no simulated time passes.
    """

    def __init__(self, directory: Path, world: World) -> None:
        if world.robot is None:
            raise ValueError("There is no robot in this world.")
        self._directory, self._robot = directory, world.robot
        camera = world.workspace.camera
        mount = CameraMount(camera.T_world_camera, WIDTH, HEIGHT, camera.vertical_fov_rad)
        self._renderer = CameraRenderer(world, mount)
        self._video = Mp4Writer(directory / CAMERA, WIDTH, HEIGHT, Fraction(FPS), _ENCODER)
        self._pick: int | None = None
        self._rows: list[tuple[int, float, np.ndarray, np.ndarray, float, float]] = []

    def close(self) -> None:
        """Write the files."""
        self._video.close()
        self._renderer.close()
        if self._rows:
            pick, times_s, *rows = (np.array(column) for column in zip(*self._rows))
            rows = [column.astype(np.float32) for column in rows]
            names = self._robot.arm.joint_names
            motion = RecordedMotion(self._robot.name, names, FPS, pick.astype(np.int16), times_s, *rows)
            save_record(motion, self._directory / TRAJECTORY)

    def __call__(self, event: Event) -> None:
        """Follow the number of the pick."""
        if isinstance(event, Looked):
            self._pick = event.pick

    def observe(self, world: World) -> None:
        """Record a frame; the simulation calls this FPS times a simulated second."""
        if self._pick is not None:
            self._video.write(self._renderer.render_color())
            self._rows.append((self._pick, world.time_s, *_sampled(world, self._robot)))


def load_motion(path: Path) -> RecordedMotion:
    """Read what TrajectoryRecorder wrote. Raises InputError if it is missing, damaged, too large or inconsistent."""
    found = load_checked(path, RecordedMotion, _MAX_UNPACKED_BYTES, "trajectory of a trial")
    fits = found.qpos.shape[1] == len(found.joint_names) and 0 < len(found) <= MAX_FRAMES
    if not fits or found.fps != FPS:
        raise InputError(f"'{path}' holds no trajectory of a trial: its numbers are not as torc writes them.")
    return found


def _sampled(world: World, robot: RobotDescription) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Return positions and commands of the arm's joints, and of the gripper's opening by its tables."""
    data, gripper = world.data, robot.gripper

    def width(value: float, table: np.ndarray) -> float:
        """Return the width at which a monotonic column of the table has that value; the nearest end outside."""
        order = np.argsort(table)
        return float(np.interp(value, table[order], gripper.widths_m[order]))

    qpos = [data.joint(name).qpos[0] for name in robot.arm.joint_names]
    ctrl = [data.actuator(name).ctrl[0] for name in robot.arm_actuator_names]
    position = float(data.joint(gripper.joint_names[0]).qpos[0])
    command = float(data.actuator(robot.gripper_actuator_name).ctrl[0])
    widths = width(position, gripper.joint_qpos[:, 0]), width(command, gripper.actuator_ctrl)
    return np.array(qpos), np.array(ctrl), *widths
