"""The way of rendering is found without breaking, and the user's wish counts."""

import subprocess
import sys
import threading

import pytest

from torc.errors import InputError, MissingDependencyError
from torc.sim import gl


@pytest.fixture(autouse=True)
def fresh():
    gl.gl_backend.cache_clear()
    yield
    gl.gl_backend.cache_clear()


@pytest.mark.parametrize(("wish", "found"), [("osmesa", "osmesa"), ("EGL ", "egl"), ("off", "rays")])
def test_the_environment_decides(monkeypatch, wish, found):
    monkeypatch.setenv("MUJOCO_GL", wish)
    assert gl.gl_backend() == found


def test_a_wrong_wish_is_named(monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "vulkan")
    with pytest.raises(InputError, match="vulkan"):
        gl.gl_backend()


def test_without_libraries_rays_remain(monkeypatch):
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setenv("PYOPENGL_PLATFORM", "none")
    assert gl.gl_backend() == "rays"


def test_a_missing_library_has_a_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco.osmesa", None)
    with pytest.raises(MissingDependencyError, match="apt-get install"):
        gl.make_context("osmesa", 10, 10)


def test_a_returned_context_is_used_again_in_its_thread_alone(monkeypatch):
    made, freed = [], []

    class Context:
        def __init__(self, *size):
            made.append(size)

        def free(self):
            freed.append(self)

    monkeypatch.setattr(gl, "make_context", lambda backend, *size: Context(*size))
    monkeypatch.setattr(gl, "_spare", gl._Spare())
    first = gl.borrow_context("egl", 10, 20)
    second = gl.borrow_context("egl", 10, 20)
    assert first is not second
    gl.return_context(first, "egl", 10, 20)
    assert gl.borrow_context("egl", 20, 10) is not first
    elsewhere = []
    thread = threading.Thread(target=lambda: elsewhere.append(gl.borrow_context("egl", 10, 20)))
    thread.start()
    thread.join()
    assert elsewhere[0] is not first
    assert gl.borrow_context("egl", 10, 20) is first
    for _ in range(9):
        gl.return_context(Context(), "egl", 10, 20)
    assert 0 < len(freed) < 9


def test_importing_the_simulation_starts_no_gl():
    code = "import sys, torc.sim.robot; sys.exit('OpenGL' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False, env={"PATH": ""}).returncode == 0


def test_a_picture_is_drawn_in_a_process_of_its_own():
    assert gl.try_drawing() == (gl.gl_backend(), "")


def test_a_process_that_dies_is_a_fault(monkeypatch):
    monkeypatch.setattr(gl.sys, "executable", "/bin/false")
    assert gl.try_drawing() == ("", "the process ended with 1")
