"""The simulated torso camera."""

import numpy as np

from torc.records import Observation
from torc.sim.closing import Closing
from torc.sim.rendering import CameraRenderer
from torc.sim.world import World


class SimulatedCamera(Closing):
    """The `Camera` of torc.robots.protocols: exact colour, depth and labels. Close it, or use it in a `with`."""

    def __init__(self, world: World, backend: str | None = None, color: bool = True) -> None:
        """Looks from the workspace's mount; GL starts at the first picture. Without colour it may be black."""
        self._world, self._backend, self._color = world, backend, color
        self._renderer: CameraRenderer | None = None

    def capture(self) -> Observation:
        """One snapshot, now. Raises MissingDependencyError if the backend asked for does not work here."""
        mount = self._world.workspace.camera
        if self._renderer is None:
            self._renderer = CameraRenderer(self._world, mount, self._backend)
        view = self._renderer.render(color=self._color)
        return Observation(
            rgb=view.rgb,
            depth_m=view.depth_m,
            K=mount.K,
            T_world_camera=mount.T_world_camera,
            qpos=self._arm_qpos(),
            stamp_s=self._world.time_s,
            label_image=view.label_image,
        )

    def close(self) -> None:
        """Frees GL; the next capture starts it again."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def _arm_qpos(self) -> np.ndarray:
        robot = self._world.robot
        if robot is None:
            return np.zeros(0)
        return np.array([self._world.data.joint(name).qpos[0] for name in robot.arm.joint_names])


def as_simulated(camera: SimulatedCamera) -> SimulatedCamera:
    """The simulated camera itself: the default of the stage `camera`."""
    return camera
