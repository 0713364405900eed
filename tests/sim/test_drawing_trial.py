"""A picture is drawn in a process of its own, whatever becomes of it."""

from torc.sim import drawing_trial
from torc.sim.gl import gl_backend


def test_a_picture_is_drawn():
    assert drawing_trial.try_drawing() == (gl_backend(), "")


def test_a_process_that_dies_is_a_fault(monkeypatch):
    monkeypatch.setattr(drawing_trial.sys, "executable", "/bin/false")
    assert drawing_trial.try_drawing() == ("", "the process ended with 1")
