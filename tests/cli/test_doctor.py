"""`torc doctor`: what it says of a machine that lacks something."""

import importlib

import pytest

from torc.cli.doctor import DoctorCommand

_load = importlib.import_module


@pytest.mark.parametrize(
    ("error", "remedy"),
    [
        (ImportError("libgomp.so.1: cannot open shared object file"), "apt-get install libgomp1"),
        (ModuleNotFoundError("No module named 'pink'"), "pip install pin-pink"),
    ],
)
def test_a_library_that_cannot_be_loaded_gets_its_remedy(error, remedy, monkeypatch, capsys):
    def load(name, package=None):
        if name == "pink":
            raise error
        return _load(name, package)

    monkeypatch.setattr(importlib, "import_module", load)
    assert DoctorCommand().run() == 1
    lines = capsys.readouterr().out.splitlines()
    found = next(k for k, line in enumerate(lines) if line.startswith("MISS  libraries"))
    assert str(error) in lines[found]
    assert lines[found + 1].strip() == f"-> {remedy}"
