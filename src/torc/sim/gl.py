"""Which way of rendering this machine offers. MuJoCo chooses its GL library when it is imported, from MUJOCO_GL, and
fails there if that library is missing; torc never sets that variable, and makes its contexts itself, after a probe with
ctypes.
"""

import ctypes
import os
from functools import cache
from importlib import import_module
from typing import Any

from torc.errors import InputError, MissingDependencyError

_LIBRARIES = ("egl", "osmesa", "glfw")
BACKENDS = (*_LIBRARIES, "rays")
"""Ways to render: three GL libraries, and ray casting on the processor, which needs none."""
_REMEDY = "apt-get install libegl1 libopengl0 libgl1-mesa-dri   (or: apt-get install libosmesa6)"
_EGL_PLATFORM_DEVICE = 0x313F
_MAX_DEVICES = 16


@cache
def gl_backend() -> str:
    """The way this process renders: MUJOCO_GL where it is set ("off" means rays), else the first of EGL and OSMesa that
    works, else rays. Raises InputError if MUJOCO_GL names something else.
    """
    wanted = os.environ.get("MUJOCO_GL", "").lower().strip()
    if wanted in ("disable", "disabled", "off", "false", "0"):
        return "rays"
    if wanted in _LIBRARIES:
        return wanted
    if wanted not in ("", "enable", "enabled", "on", "true", "1"):
        raise InputError(
            f"MUJOCO_GL is '{wanted}'; torc knows {', '.join(_LIBRARIES)}, off, or leave it unset."
        )
    platform = os.environ.get("PYOPENGL_PLATFORM", "").lower()
    if platform in ("", "egl") and _egl_works():
        return "egl"
    if platform in ("", "osmesa") and _loads("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"):
        return "osmesa"
    return "rays"


def make_context(backend: str, width: int, height: int) -> Any:
    """A GL context for images up to that size, pixels; with make_current() and free(). Raises MissingDependencyError if
    the library is missing or has no device.
    """
    try:
        return import_module(f"mujoco.{backend}").GLContext(width, height)
    except (ImportError, AttributeError, OSError, RuntimeError) as error:
        raise MissingDependencyError(f"Rendering with {backend} ({error})", _REMEDY) from error


def _loads(*names: str) -> ctypes.CDLL | None:
    for name in names:
        try:
            return ctypes.CDLL(name)
        except OSError:
            continue
    return None


def _egl_works() -> bool:
    """Whether EGL is there and some device of it can be initialised without a display server."""
    egl = _loads("libEGL.so.1", "libEGL.so")
    if egl is None or not _loads("libOpenGL.so.0", "libGL.so.1", "libGL.so"):
        return False
    address = egl.eglGetProcAddress
    address.restype, address.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    query, display_of = address(b"eglQueryDevicesEXT"), address(b"eglGetPlatformDisplayEXT")
    if not query or not display_of:
        return False
    pointer = ctypes.c_void_p
    query_devices = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, pointer, pointer)(query)
    get_display = ctypes.CFUNCTYPE(pointer, ctypes.c_uint, pointer, pointer)(display_of)
    egl.eglInitialize.restype, egl.eglInitialize.argtypes = ctypes.c_uint, [pointer, pointer, pointer]
    devices, count = (pointer * _MAX_DEVICES)(), ctypes.c_int()
    if not query_devices(
        _MAX_DEVICES, ctypes.cast(devices, pointer), ctypes.cast(ctypes.byref(count), pointer)
    ):
        return False
    displays = (get_display(_EGL_PLATFORM_DEVICE, devices[i], None) for i in range(count.value))
    return any(display and egl.eglInitialize(display, None, None) for display in displays)
