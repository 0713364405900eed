"""`torc doctor` says whether a picture can be drawn."""

from torc.cli import doctor
from torc.sim import drawing_trial


def test_the_doctor_says_what_was_drawn(monkeypatch):
    monkeypatch.setattr(drawing_trial, "try_drawing", lambda: ("", "the display is gone"))
    monkeypatch.setenv("PYOPENGL_PLATFORM", "glx")
    finding = doctor._rendering()
    assert finding.required
    assert not finding.ok
    assert "the display is gone" in finding.detail
    assert "Unset PYOPENGL_PLATFORM=glx" in finding.remedy
    monkeypatch.setattr(drawing_trial, "try_drawing", lambda: ("rays", ""))
    assert not doctor._rendering().required
