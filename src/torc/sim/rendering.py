"""Draw the simulated world: colour, depth and labels, by GL if available, else by rays.

Cameras are given in the OpenCV frame and are converted to MuJoCo's only here.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np
from jaxtyping import Float32, Int16, UInt8

from torc.errors import InputError
from torc.geometry.transforms import Pose
from torc.records import BACKGROUND
from torc.sim.gl import BACKENDS, borrow_context, gl_backend, return_context
from torc.sim.raycasting import cast, pixel_directions, shade
from torc.sim.simulated_world import World
from torc.workspace.description import CameraMount

_NEAR_M, _FAR_M, _MAX_DEPTH_M = 0.02, 30.0, 10.0
_MAX_SCENE_GEOMS = 4000


@dataclass(frozen=True)
class View:
    """What a camera sees.

    Attributes:
        depth_m: along the optical axis, metres, 0 where nothing is within range.
        label_image: object id, BACKGROUND or ROBOT per pixel.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float32[np.ndarray, "h w"]
    label_image: Int16[np.ndarray, "h w"]


class Closing(ABC):
    """Close it, or use it in a `with` statement."""

    @abstractmethod
    def close(self) -> None:
        """Free what it holds."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class CameraRenderer(Closing):
    """Renders one camera of a world repeatedly, and changes nothing that the physics reads."""

    def __init__(self, world: World, mount: CameraMount, backend: str | None = None) -> None:
        """Render with the process's backend (`gl_backend()`), or the one named.

        Raises InputError for an unknown backend, and MissingDependencyError for one that does not work here.
        """
        self.backend = gl_backend() if backend is None else backend
        if self.backend not in BACKENDS:
            raise InputError(f"Unknown rendering backend '{self.backend}'; known: {', '.join(BACKENDS)}.")
        self._world, self._mount = world, mount
        self._gl = None if self.backend == "rays" else _GlImages(world.model, mount, self.backend)

    def render(self, T_world_camera: Pose | None = None, color: bool = True) -> View:
        """Return colour, depth and labels of the world now, from the given camera pose if any.

        Without colour the picture is black, which takes half of the time.
        """
        self._world.update_kinematics()
        T = self._mount.T_world_camera if T_world_camera is None else T_world_camera
        # Geom -1 (nothing) reads the last entry.
        labels_of_geoms = np.append(self._world.geom_labels, np.int16(BACKGROUND))
        if self._gl is None:
            rgb, depth, geoms = self._cast(T)
            labels = labels_of_geoms[geoms]
        else:
            labels, depth = self._gl.labels_and_depth(self._world.data, T, labels_of_geoms)
            rgb = self._gl.color(self._world.data, T) if color else np.zeros((*depth.shape, 3), np.uint8)
        depth[depth > _MAX_DEPTH_M] = 0.0
        return View(rgb, depth, labels)

    def look_from(self, mount: CameraMount) -> None:
        """Draw further pictures with another camera of equal image size. Raises ValueError for another size."""
        if (mount.width, mount.height) != (self._mount.width, self._mount.height):
            raise ValueError("A renderer's images keep their size.")
        self._mount = mount
        if self._gl is not None:
            self._gl.mount = mount

    def render_color(self) -> UInt8[np.ndarray, "h w 3"]:
        """Return colour alone, for videos."""
        self._world.update_kinematics()
        T = self._mount.T_world_camera
        return self._cast(T)[0] if self._gl is None else self._gl.color(self._world.data, T)

    def close(self) -> None:
        """Free the GL context; the renderer cannot be used afterwards."""
        if self._gl is not None:
            self._gl.close()

    def _cast(self, T_world_camera: Pose) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        w, h = self._mount.width, self._mount.height
        directions = pixel_directions(self._mount.K, w, h)
        model = self._world.model
        depth, geoms, normals = cast(model, self._world.data, T_world_camera, directions, _FAR_M)
        return shade(model, geoms, normals).reshape(h, w, 3), depth.reshape(h, w), geoms.reshape(h, w)


class _GlImages:
    """MuJoCo's scene and GL buffers for one image size."""

    def __init__(self, model: mujoco.MjModel, mount: CameraMount, backend: str) -> None:
        self._model, self.mount = model, mount
        self._kind = backend, mount.width, mount.height
        self._context = borrow_context(*self._kind)
        self._context.make_current()
        self._scene = mujoco.MjvScene(model, maxgeom=_MAX_SCENE_GEOMS)
        self._option, self._camera = mujoco.MjvOption(), mujoco.MjvCamera()
        self._rect = mujoco.MjrRect(0, 0, mount.width, mount.height)
        self._buffers = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_resizeOffscreen(mount.width, mount.height, self._buffers)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._buffers)
        self._buffers.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR.value

    def color(self, data: mujoco.MjData, T_world_camera: Pose) -> UInt8[np.ndarray, "h w 3"]:
        rgb = np.empty((self.mount.height, self.mount.width, 3), np.uint8)
        self._draw(data, T_world_camera, numbers=False)
        mujoco.mjr_readPixels(rgb, None, self._rect, self._buffers)
        return np.ascontiguousarray(rgb[::-1])

    def labels_and_depth(
        self, data: mujoco.MjData, T_world_camera: Pose, labels_of_geoms: Int16[np.ndarray, "g"]
    ) -> tuple[Int16[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]:
        """Return the label of the geom per pixel (the last one for none) and depth, metres."""
        shape = (self.mount.height, self.mount.width)
        rgb, z = np.empty((*shape, 3), np.uint8), np.empty(shape, np.float32)
        self._draw(data, T_world_camera, numbers=True)
        mujoco.mjr_readPixels(rgb, z, self._rect, self._buffers)
        number = rgb[::-1, :, 0] + np.uint16(256) * rgb[::-1, :, 1]
        # From a reversed depth buffer: 1 is the near plane, 0 the far plane.
        depth = z[::-1].astype(np.float64)
        depth *= _FAR_M - _NEAR_M
        depth += _NEAR_M
        np.divide(_NEAR_M * _FAR_M, depth, out=depth)
        depth[z[::-1] <= 0] = 0.0
        return labels_of_geoms[self._geom_of_number()][number], depth.astype(np.float32)

    def close(self) -> None:
        if self._context is not None:
            self._context.make_current()
            self._buffers.free()
            return_context(self._context, *self._kind)
            self._context = None

    def _draw(self, data: mujoco.MjData, T_world_camera: Pose, numbers: bool) -> None:
        self._context.make_current()
        mujoco.mjv_updateScene(
            self._model, data, self._option, None, self._camera, mujoco.mjtCatBit.mjCAT_ALL.value, self._scene
        )
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = numbers
        self._scene.flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = numbers
        half = _NEAR_M * np.tan(0.5 * self.mount.vertical_fov_rad)
        for eye in self._scene.camera:  # MuJoCo averages the two eyes
            eye.pos[:] = T_world_camera[:3, 3]
            eye.forward[:], eye.up[:] = T_world_camera[:3, 2], -T_world_camera[:3, 1]
            eye.frustum_center, eye.frustum_width = 0.0, 0.0
            eye.frustum_bottom, eye.frustum_top = -half, half
            eye.frustum_near, eye.frustum_far = _NEAR_M, _FAR_M
        mujoco.mjr_render(self._rect, self._scene, self._buffers)

    def _geom_of_number(self) -> np.ndarray:
        table = np.full(self._scene.ngeom + 1, -1, np.int32)
        for geom in self._scene.geoms[: self._scene.ngeom]:
            if geom.segid >= 0 and geom.objtype == mujoco.mjtObj.mjOBJ_GEOM:
                table[geom.segid + 1] = geom.objid
        return table
