"""`torc doctor` says whether a picture can be drawn."""

import sys

import pytest

from torc.cli import doctor
from torc.sim import gl


def test_the_doctor_says_what_was_drawn(monkeypatch):
    monkeypatch.setattr(gl, "try_drawing", lambda: ("", "the display is gone"))
    monkeypatch.setenv("PYOPENGL_PLATFORM", "glx")
    finding = doctor._rendering()
    assert finding.required
    assert not finding.ok
    assert "the display is gone" in finding.detail
    assert "Unset PYOPENGL_PLATFORM=glx" in finding.remedy
    monkeypatch.setattr(gl, "try_drawing", lambda: ("rays", ""))
    assert not doctor._rendering().required


@pytest.mark.parametrize("packages", [("mujoco-core",), ("mujoco", "mujoco-core")])
def test_two_packages_that_share_a_folder_are_noted(monkeypatch, packages):
    monkeypatch.setattr("importlib.metadata.distributions", lambda name: [name] if name in packages else [])
    notes = list(doctor._two_mujocos())
    assert len(notes) == len(packages) - 1
    assert all(not note.ok and not note.required for note in notes)


@pytest.mark.parametrize(
    ("files", "foreign"),
    [
        ([], False),
        (["pyzed.py"], True),
        (["pyzed/__init__.py"], True),
        (["pyzed/__init__.py", "pyzed/sl.py"], False),
    ],
)
def test_a_foreign_pyzed_is_noted(monkeypatch, tmp_path, files, foreign):
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    for name in files:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    try:
        notes = list(doctor._foreign_pyzed())
    finally:
        for name in ("pyzed", "pyzed.sl"):
            sys.modules.pop(name, None)
    assert [(note.name, note.ok, note.required) for note in notes] == [("pyzed", False, False)] * foreign
