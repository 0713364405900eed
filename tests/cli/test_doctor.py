"""`torc doctor`: what it says of a machine that lacks something."""

import importlib

from torc.cli.doctor import DoctorCommand

_load = importlib.import_module


def test_a_library_that_cannot_be_loaded_gets_its_remedy(monkeypatch, capsys):
    def load(name, package=None):
        if name == "cv2":
            raise ModuleNotFoundError("No module named 'cv2'")
        return _load(name, package)

    monkeypatch.setattr(importlib, "import_module", load)
    assert DoctorCommand().run() == 1
    out = capsys.readouterr().out
    assert "MISS  library: cv2: No module named 'cv2'\n      -> pip install opencv-python-headless\n" in out
