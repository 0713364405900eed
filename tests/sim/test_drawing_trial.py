"""A picture is drawn in a process of its own, whatever becomes of it."""

from torc.sim import drawing_trial
from torc.sim.gl import gl_backend


def test_a_picture_is_drawn():
    assert drawing_trial.try_drawing() == (gl_backend(), "")


def test_a_process_that_dies_is_a_fault(monkeypatch):
    monkeypatch.setattr(drawing_trial.sys, "executable", "/bin/false")
    assert drawing_trial.try_drawing() == ("", "the process ended with 1")


def test_the_doctor_says_what_was_drawn(monkeypatch):
    from torc.cli import doctor

    monkeypatch.setattr(drawing_trial, "try_drawing", lambda: ("", "the display is gone"))
    monkeypatch.setenv("PYOPENGL_PLATFORM", "glx")
    finding = doctor._rendering()
    assert finding.required
    assert not finding.ok
    assert "the display is gone" in finding.detail
    assert "Unset PYOPENGL_PLATFORM=glx" in finding.remedy
    monkeypatch.setattr(drawing_trial, "try_drawing", lambda: ("rays", ""))
    assert not doctor._rendering().required
