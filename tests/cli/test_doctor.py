"""`torc doctor`: what it says of a machine that lacks something."""

import importlib

from torc.cli.doctor import DoctorCommand

_load = importlib.import_module


def test_a_library_that_cannot_be_loaded_gets_its_remedy(monkeypatch, capsys):
    error = ModuleNotFoundError("No module named 'cv2'")

    def load(name, package=None):
        if name == "cv2":
            raise error
        return _load(name, package)

    monkeypatch.setattr(importlib, "import_module", load)
    assert DoctorCommand().run() == 1
    lines = capsys.readouterr().out.splitlines()
    found = next(k for k, line in enumerate(lines) if line.startswith("MISS  libraries"))
    assert str(error) in lines[found]
    assert lines[found + 1].strip() == "-> pip install opencv-python-headless"
